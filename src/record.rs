//! What a command was run with: its words, its options, the files that it read, and what the user states of the work.

use crate::cli::{self, ReportArgs};
use crate::command_line;
use crate::defaults;
use crate::error::CommandError;
use crate::files::{self, folder_of};
use crate::values::LONGEST_FIELD;
use clap::parser::ValueSource;
use clap::{ArgMatches, Command};
use gml_compiler::program::Program;
use gml_compiler::source::SourceFile;
use gml_runtime::export::report::Scripts;
use gml_runtime::record::{Field, Record, Setting, UsedFile, hexadecimal};
use gml_runtime::scan::ScanSource;
use sha2::{Digest, Sha256};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The file beside a script that states the same as `--report-field`.
const FIELDS: &str = "report.toml";

/// Options that say nothing of the result.
const BESIDES: [&str; 12] =
    ["output", "report-field", "trace", "format", "json", "help", "version", "jobs", "retry", "list", "memory", "dask"];

/// The record of this process, which works with a script or a reference.
pub(crate) fn of_process(report: &ReportArgs, script: &Path) -> Result<Record, CommandError> {
    of_line_of_words(report, script, command_line::words())
}

/// The record of a command line, whose first word is the program's name.
pub(crate) fn of_words(report: &ReportArgs, script: &Path, words: &[String]) -> Result<Record, CommandError> {
    of_line_of_words(report, script, words.iter().map(OsString::from).collect())
}

fn of_line_of_words(report: &ReportArgs, script: &Path, words: Vec<OsString>) -> Result<Record, CommandError> {
    let mut words = words;
    if let Some(first) = words.first_mut() {
        *first = "gmlc".into();
    }
    let command: Vec<String> = words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    let all = cli::definition();
    let defaults = defaults::of_process();
    let words = defaults.map_or_else(|| cli::with_negative_values(words), |defaults| defaults.words.clone());
    let matches = all.clone().try_get_matches_from(words).map_err(CommandError::usage)?;
    let mut settings = match matches.subcommand() {
        Some((name, matches)) => all.find_subcommand(name).map(|c| settings(c, matches)).unwrap_or_default(),
        None => Vec::new(),
    };
    // What the file beside the script says is not given on the command line.
    let taken = defaults.map_or(&[][..], |defaults| &defaults.taken);
    settings.iter_mut().filter(|setting| taken.contains(&setting.name)).for_each(|setting| setting.given = false);
    let mut record = Record { command, settings, ..begun() };
    record.files.extend(defaults.map(|defaults| used("defaults", &defaults.path, defaults.text.as_bytes())));
    state(&mut record, report, script)?;
    Ok(record)
}

/// The record of a line of a session.
pub(crate) fn of_line(line: &str, command: &Command, words: Vec<String>) -> Record {
    let matches =
        command.clone().try_get_matches_from(cli::with_negative_values(words.into_iter().map(OsString::from)));
    let settings = matches.map(|matches| settings(command, &matches)).unwrap_or_default();
    Record { command: vec!["gmlc".to_owned(), "repl".to_owned(), line.to_owned()], settings, ..begun() }
}

/// The record of work that a program has asked for with these options.
pub(crate) fn of_embedded(report: &ReportArgs, script: &Path, words: &[&[String]]) -> Result<Record, CommandError> {
    let given = words.iter().copied().flatten();
    let setting = |word: &String| {
        let (name, value) = word.trim_start_matches("--").split_once('=').unwrap_or((word, "true"));
        Setting { name: name.trim_start_matches("--").to_owned(), values: vec![value.to_owned()], given: true }
    };
    let settings = given.clone().map(setting).collect();
    let command = ["gmlc", "inspect"].map(str::to_owned).into_iter().chain(given.cloned()).collect();
    let mut record = Record { command, settings, ..begun() };
    state(&mut record, report, script)?;
    Ok(record)
}

fn begun() -> Record {
    Record { tool: concat!("gmlc ", env!("CARGO_PKG_VERSION")).to_owned(), time: now(), ..Record::default() }
}

/// The time in UTC (ISO 8601).
pub(crate) fn now() -> String {
    chrono::Utc::now().format("%Y-%m-%dT%H:%M:%SZ").to_string()
}

/// All options of a command that have a value, in the order of its help.
fn settings(command: &Command, matches: &ArgMatches) -> Vec<Setting> {
    let setting = |arg: &clap::Arg| {
        let name = arg.get_long().filter(|name| !BESIDES.contains(name))?;
        let id = arg.get_id().as_str();
        let values = matches.try_get_raw(id).ok().flatten()?;
        let values: Vec<String> = values.map(|value| value.to_string_lossy().into_owned()).collect();
        let given = matches.value_source(id) == Some(ValueSource::CommandLine);
        Some(Setting { name: name.to_owned(), values, given })
    };
    command.get_arguments().filter_map(setting).collect()
}

/// The file beside a script in which the user states the work.
pub(crate) fn fields_file(script: &Path) -> PathBuf {
    folder_of(script).join(FIELDS)
}

/// Adds what the user states: on the command line, or else in the file beside the script.
fn state(record: &mut Record, report: &ReportArgs, script: &Path) -> Result<(), CommandError> {
    for (name, value) in &report.fields {
        if record.fields.iter().any(|field| field.name == *name) {
            return Err(CommandError::usage(format!("--report-field {name}: it is given twice; leave one out")));
        }
        record.fields.push(Field { name: name.clone(), value: value.clone() });
    }
    let path = fields_file(script);
    if !path.is_file() {
        return Ok(());
    }
    let text = files::read_settings(&path)?;
    let failed = |what: String| CommandError::Failed(format!("{}: {what}", path.display()));
    for field in stated(&text).map_err(failed)? {
        if record.fields.iter().all(|given| given.name != field.name) {
            record.fields.push(field);
        }
    }
    record.files.push(used("fields", &path, text.as_bytes()));
    Ok(())
}

/// The fields of a TOML document, in its order.
fn stated(text: &str) -> Result<Vec<Field>, String> {
    let table: toml::Table = text
        .parse()
        .map_err(|e: toml::de::Error| format!("is not TOML, such as `\"Part number\" = \"A-17\"`: {}", e.message()))?;
    let field = |(name, value): (String, toml::Value)| match value {
        toml::Value::String(text) if text.len() > LONGEST_FIELD => {
            Err(format!("`{name}` has more than {LONGEST_FIELD} bytes"))
        }
        toml::Value::String(value) => Ok(Field { name, value }),
        toml::Value::Integer(number) => Ok(Field { name, value: number.to_string() }),
        toml::Value::Float(number) => Ok(Field { name, value: number.to_string() }),
        toml::Value::Boolean(yes) => Ok(Field { name, value: if yes { "yes" } else { "no" }.to_owned() }),
        toml::Value::Datetime(date) => Ok(Field { name, value: date.to_string() }),
        toml::Value::Table(_) | toml::Value::Array(_) => {
            Err(format!("`{name}` has several values; write one text, a number or a date"))
        }
    };
    table.into_iter().map(field).collect()
}

/// Adds the scans, the texts of the script, and the fit that values were taken from.
pub(crate) fn add_inputs(record: &mut Record, scans: &[ScanSource], program: &Program, params: Option<&Path>) {
    scans.iter().for_each(|scan| add_scan(record, scan));
    let scripts = program.sources().scripts();
    // The standard library belongs to the version.
    record.files.extend(scripts.map(|file| used("script", Path::new(file.name.as_str()), file.text.as_bytes())));
    let fonts = program.sources().fonts().iter();
    record.files.extend(fonts.map(|font| used("font", Path::new(font.name.as_str()), &font.bytes)));
    if let Some(params) = params {
        add_file(record, "fit", params);
    }
}

/// A model's scripts for the documents.
pub(crate) fn scripts(program: &Program) -> Scripts {
    let sources = program.sources();
    let name = |file: &SourceFile| file_name(Path::new(file.name.as_str()));
    let declared = |part: usize| {
        let span = program.part_span(part);
        sources
            .get(span.file)
            .map_or_else(String::new, |file| format!("{}:{}", name(file), sources.line_column(span).0))
    };
    Scripts {
        texts: sources.scripts().map(|file| (name(file), file.text.to_string())).collect(),
        declared: (0..program.parts().len()).map(declared).collect(),
    }
}

/// Adds a scan.
pub(crate) fn add_scan(record: &mut Record, scan: &ScanSource) {
    let name = file_name(Path::new(&scan.path));
    record.files.push(UsedFile { role: "scan".to_owned(), name, sha256: scan.sha256.clone() });
}

/// Adds another file that was read.
pub(crate) fn add_file(record: &mut Record, role: &str, path: &Path) {
    // It has been read before, so that it is there.
    if let Ok(bytes) = std::fs::read(path) {
        record.files.push(used(role, path, &bytes));
    }
}

fn used(role: &str, path: &Path, bytes: &[u8]) -> UsedFile {
    UsedFile { role: role.to_owned(), name: file_name(path), sha256: hexadecimal(Sha256::digest(bytes)) }
}

/// The name of a file, without its folders.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_read_in_order() {
        let text = "\"Part number\" = \"A-17\"\nOperator = 'R. Roe'\nCalibrated = 2024-05-06\nTemperature = 20.5\n";
        let fields: Vec<(String, String)> =
            stated(text).expect("TOML").into_iter().map(|f| (f.name, f.value)).collect();
        let expected =
            [("Part number", "A-17"), ("Operator", "R. Roe"), ("Calibrated", "2024-05-06"), ("Temperature", "20.5")];
        assert_eq!(fields, expected.map(|(name, value)| (name.to_owned(), value.to_owned())));
        assert!(stated("a = [1]").unwrap_err().contains("`a` has several values"));
        assert!(stated("a =").unwrap_err().contains("is not TOML"));
    }
}
