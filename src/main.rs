//! The executable of the command `asperity`.

use std::process::ExitCode;

fn main() -> ExitCode {
    asperity::cli::main()
}
