//! What a command says when it is done.

use serde_json::Value;

/// A sentence for people, and the result for programs.
#[derive(Clone, Debug)]
pub struct Summary {
    /// What was made, where it is, and what to be warned of.
    pub text: String,
    /// The result itself.
    pub json: Value,
}

impl Summary {
    /// Prints the sentence, or the JSON.
    #[expect(clippy::print_stdout, reason = "the program's own output")]
    pub(super) fn print(&self, as_json: bool) {
        if as_json { println!("{}", self.json) } else { println!("{}", self.text) }
    }
}

/// Warnings as lines after the sentence.
pub(super) fn listed(warnings: &[String]) -> String {
    warnings.iter().map(|warning| format!("\nwarning: {warning}")).collect()
}
