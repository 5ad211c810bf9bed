//! The program: a process around the command.

use std::process::ExitCode;

fn main() -> ExitCode {
    gmlc::environment::without_display();
    // A reader that closes the pipe early, such as `head`, ends the command quietly.
    sigpipe::reset();
    ExitCode::from(gmlc::command(std::env::args_os().collect()))
}
