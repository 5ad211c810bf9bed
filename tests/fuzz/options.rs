//! Options with extreme values. Commands and their options are taken from the help, which is made from the definition
//! of the command line: what is added there is covered here.

use crate::case::Case;
use crate::damage::Random;
use crate::mutate::choose;
use crate::process;
use std::path::Path;

struct Flag {
    /// With its dashes.
    name: String,
    /// It may stand alone, without a value.
    alone: bool,
    /// Words of its help: names of choices, examples.
    words: Vec<String>,
}

struct Subcommand {
    name: String,
    /// The words that it needs, with files in place of their names.
    needs: Vec<String>,
    flags: Vec<Flag>,
}

pub(crate) struct Commands {
    commands: Vec<Subcommand>,
}

fn help(args: &[&str]) -> String {
    let args: Vec<String> = args.iter().map(|a| (*a).to_owned()).collect();
    let ended = process::run(Path::new("."), &args, &[], false);
    assert_eq!(ended.status, Some(0), "gmlc {args:?}: {}", ended.error);
    ended.output
}

/// A file for what the line of usage names.
fn file_for(command: &str, name: &str) -> &'static str {
    match (command, name) {
        ("doc" | "mesh" | "scan" | "variance" | "inspect" | "batch", "DIR") => "out",
        ("mesh" | "scan" | "convert", "FILE") => "new.ply",
        (_, "MODEL" | "MODEL.gml" | "MODEL.gml|std" | "REFERENCE" | "A" | "PATH") => "ball.gml",
        (_, "SCAN") => "scan.ply",
        (_, "B") => "fit.json",
        (_, "STAGE") => "ir",
        (_, "SHELL") => "bash",
        _ => panic!("gmlc {command} needs <{name}>: name a file for it here"),
    }
}

impl Subcommand {
    fn of(name: &str) -> Subcommand {
        let text = help(&[name, "--help"]);
        let usage = text.lines().find_map(|l| l.strip_prefix("Usage: gmlc ")).expect("a line of usage");
        let needs = usage.split_whitespace().skip(1).filter(|w| *w != "[OPTIONS]").filter_map(|word| {
            let named = word.trim_start_matches('[').strip_prefix('<').and_then(|w| w.split('>').next());
            match named {
                Some(named) => Some(file_for(name, named).to_owned()),
                None if word.starts_with('[') => match name {
                    "check" => Some("ball.gml".to_owned()),
                    "batch" => Some("scan.ply".to_owned()),
                    _ => None,
                },
                None => Some(word.to_owned()),
            }
        });
        Subcommand { name: name.to_owned(), needs: needs.collect(), flags: flags(&text) }
    }
}

/// The options of a page of help.
fn flags(text: &str) -> Vec<Flag> {
    let mut flags: Vec<Flag> = Vec::new();
    let options = text.split("\nOptions:\n").nth(1).unwrap_or_default();
    for line in options.lines() {
        let begins = line.trim_start().split("--").nth(1).filter(|_| line.trim_start().starts_with('-'));
        if let Some(rest) = begins.filter(|_| line.len() - line.trim_start().len() <= 6) {
            let name: String = rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
            flags.push(Flag { alone: !rest.contains('<'), name: format!("--{name}"), words: Vec::new() });
        }
        let Some(flag) = flags.last_mut() else { continue };
        let strip = |w: &str| w.trim_matches(|c: char| !c.is_alphanumeric()).to_owned();
        flag.words.extend(line.split_whitespace().map(strip).filter(|w| !w.is_empty()));
    }
    flags
}

/// Values that no option may stumble over.
const VALUES: [&str; 72] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "7",
    "0.5",
    "1e-320",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "2147483648",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999",
    "0mm",
    "1e-13mm",
    "1e-12mm",
    "1e-6mm",
    "0.001mm",
    "0.1mm",
    "5mm",
    "100mm",
    "1e6mm",
    "1e12mm",
    "1e13mm",
    "1e300mm",
    "nanmm",
    "infmm",
    "1mm2",
    "90deg",
    "0deg",
    "180deg",
    "1e9deg",
    "1turn",
    "",
    " ",
    "=",
    "r",
    "r=",
    "=5",
    "r=20mm",
    "r=1e308mm",
    "r=nan",
    "r=20deg",
    "r=20mm=3",
    "flat=1",
    "flat",
    "n=1",
    "n=2",
    "n=1..3",
    "n=3..1",
    "n=0..1e18",
    "n=-9223372036854775808..9223372036854775807",
    "r,flat",
    "r,r",
    "r,",
    "0,90",
    "1e300,nan",
    "64",
    "100000x100000",
    "1x1",
    "64MB",
    "1e30GB",
    "width=0.1mm",
    "p=0.1mm..0.2mm",
];

/// Values that are files, folders, or no text for a terminal.
const PATHS: [&str; 18] = [
    "ball.gml",
    "scan.ply",
    "fit.json",
    "absent.json",
    "absent/new.json",
    ".",
    "..",
    "/",
    "/dev/null",
    "/dev/full",
    "/dev/zero",
    "new.xyz",
    "new",
    "new.json",
    "new.csv",
    "\u{202e}\u{1b}[31m",
    "größe=1",
    "--",
];

impl Commands {
    pub(crate) fn of_the_command() -> Commands {
        let text = help(&["--help"]);
        let list = text.split("Commands:\n").nth(1).and_then(|t| t.split("\n\n").next()).expect("commands");
        let names = list.lines().filter_map(|l| l.split_whitespace().next()).filter(|n| *n != "help");
        let commands: Vec<Subcommand> = names.map(Subcommand::of).collect();
        assert!(commands.len() > 10 && commands.iter().all(|c| c.flags.len() > 1), "the help is understood");
        Commands { commands }
    }

    /// A random case: a command with one to four of its options.
    pub(crate) fn case(&self, random: &mut Random) -> Case {
        let command = &self.commands[random.below(self.commands.len())];
        let mut args = vec![command.name.clone()];
        args.extend(command.needs.iter().cloned());
        for _ in 0..1 + random.below(2) * random.below(4) {
            let flag = &command.flags[random.below(command.flags.len())];
            if flag.name != "--help" {
                args.push(flag.name.clone());
                args.extend((!flag.alone).then(|| value(flag, random)));
            }
        }
        // Work that is not asked for stays small.
        if matches!(command.name.as_str(), "variance" | "inspect" | "compare") && random.below(8) > 0 {
            args.extend(["--resolution", "32"].map(str::to_owned));
            args.dedup();
        }
        let mut case = Case { args, ..Case::default() };
        if command.name == "repl" {
            case.input = b"let a = 1\na / 0\n".to_vec();
        }
        case
    }
}

fn value(flag: &Flag, random: &mut Random) -> String {
    match random.below(8) {
        0..4 => choose(random, &VALUES).to_owned(),
        4 => choose(random, &PATHS).to_owned(),
        5 if random.below(8) == 0 => "9".repeat(1 << random.below(16)),
        _ => flag.words[random.below(flag.words.len())].clone(),
    }
}
