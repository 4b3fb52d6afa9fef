//! What a command says when it is done.

use serde_json::Value;
use std::io::Write;

/// A sentence for people, and the result for programs.
#[derive(Clone, Debug)]
pub struct Summary {
    /// What was made, where it is, and what to be warned of.
    pub text: String,
    /// The result itself.
    pub json: Value,
}

impl Summary {
    /// Writes the sentence, or the JSON, as a line.
    pub(super) fn print(&self, as_json: bool, to: &mut impl Write) -> std::io::Result<()> {
        if as_json {
            writeln!(to, "{}", self.json)?
        } else {
            writeln!(to, "{}", self.text)?
        }
        to.flush()
    }
}

/// Warnings as lines after the sentence.
pub(super) fn listed(warnings: &[String]) -> String {
    warnings.iter().map(|warning| format!("\nwarning: {warning}")).collect()
}
