//! The built command, end to end: one binary, since each costs its linking.

mod architecture;
mod command;
mod diagnostics;
mod documentation;
mod examples;
mod inspect;
#[cfg(unix)]
mod interrupt;
mod nist;
mod prose;
mod repl;
mod search;
mod support;
mod variance;
#[path = "../viewers/scene.rs"]
mod viewer_scene;
