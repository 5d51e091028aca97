//! The `asperity` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    asperity::cli::main()
}
