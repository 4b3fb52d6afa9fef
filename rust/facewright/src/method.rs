//! The paper's way or ours.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// Which chain of steps to run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The steps of Liang, Pan, Chen 2004.
    Paper,
    /// Ours.
    #[default]
    Default,
}
