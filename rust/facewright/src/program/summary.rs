//! What a command says when it is done.

use serde_json::Value;
use std::io::Write;

/// A sentence for people, the result for programs, and warnings for both.
#[derive(Clone, Debug)]
pub struct Summary {
    /// What was made, and where it is.
    pub text: String,
    /// What to be warned of.
    pub warnings: Vec<String>,
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

    /// Writes a line for each warning.
    pub(super) fn warn(&self, to: &mut impl Write) -> std::io::Result<()> {
        self.warnings.iter().try_for_each(|warning| writeln!(to, "warning: {warning}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_result_and_its_warnings_are_written_apart() {
        let warnings = vec!["the head turns little".to_owned(), "it is dark".to_owned()];
        let summary = Summary { text: "done".to_owned(), warnings, json: Value::Null };
        let written = |write: &dyn Fn(&mut Vec<u8>) -> std::io::Result<()>| {
            let mut to = Vec::new();
            write(&mut to).unwrap();
            String::from_utf8(to).unwrap()
        };
        assert_eq!(written(&|to| summary.print(false, to)), "done\n");
        assert_eq!(written(&|to| summary.print(true, to)), "null\n");
        assert_eq!(written(&|to| summary.warn(to)), "warning: the head turns little\nwarning: it is dark\n");
    }
}
