//! The `facewright` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    facewright::program::main()
}
