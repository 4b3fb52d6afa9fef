//! `facewright board`.

use super::summary::Summary;
use crate::pictures::board::{SheetOptions, sheet};
use crate::{FacewrightError, write_drawing};
use clap::Args;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Writes a board to print, exact at 100 % print scale
#[derive(Clone, Debug, Args, Serialize)]
pub struct BoardCommand {
    /// What is printed, and on what.
    #[command(flatten)]
    pub options: SheetOptions,
    /// SVG, PDF or PNG file to write
    #[arg(short, long, default_value = "board.svg")]
    output: PathBuf,
}

impl BoardCommand {
    pub(super) fn run(&self) -> Result<Summary, FacewrightError> {
        write_drawing(&self.output, &sheet(&self.options)?, self.options.dpi)?;
        let text = format!("{}: print at 100 % and check the rulers", self.output.display());
        Ok(Summary { text, warnings: Vec::new(), json: json!({ "board": self.output }) })
    }
}
