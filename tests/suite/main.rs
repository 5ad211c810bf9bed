//! The built command, end to end. There is one test binary, because linking each takes long.

mod architecture;
mod awkward;
mod batch;
mod bodies;
mod browser;
mod command;
mod compare;
#[cfg(unix)]
mod concurrency;
mod convert;
#[cfg(unix)]
mod defaults;
mod diagnostics;
mod dimensions;
mod documentation;
mod edges;
#[cfg(unix)]
mod ended;
mod examples;
mod exports;
mod fillets;
mod gaps;
mod held;
mod inspect;
#[cfg(unix)]
mod interrupt;
mod limits;
#[cfg(unix)]
mod messages;
mod nist;
mod options;
mod outlines;
mod pipe;
mod prose;
mod repl;
#[cfg(unix)]
mod robust;
mod rounding;
mod saved;
mod scan_colours;
mod search;
mod several;
#[cfg(unix)]
mod signals;
mod solids;
mod support;
mod uneven;
mod unsound;
mod variance;
mod verdicts;
#[path = "../viewers/scene.rs"]
mod viewer_scene;
