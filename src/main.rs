//! The executable of the command `asperity`.

use std::env;
use std::process::ExitCode;

fn main() -> ExitCode {
    asperity::internal::command(env::args_os(), None)
}
