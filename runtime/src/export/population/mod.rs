//! The documents of many inspections: tables, the maps of all deviations, and a page.

mod chart;
mod columns;
mod maps;
mod page;
mod parquet;

#[cfg(test)]
mod tests;

pub use maps::MapDocuments;

use super::atomic::{self, WriteError};
use super::exchange::csv;
use super::json;
use super::measurement::DocumentError;
use crate::population::{CommonTexture, DeviationMap, Row, Summary};
use columns::{Cells, Column};
use std::io;
use std::path::Path;

/// The table as comma-separated values: a row a scan.
pub const TABLE: &str = "table.csv";

/// The same table as Parquet.
pub const PARQUET: &str = "table.parquet";

/// The page.
pub const PAGE: &str = "summary.html";

/// The figures of the page.
pub const FIGURES: &str = "summary.json";

/// The folder of the results of single scans.
pub const SCANS: &str = "scans";

/// What the documents of many inspections are made from.
pub struct PopulationDocuments<'a> {
    /// The rows, in the order of the scans.
    pub rows: &'a [Row],
    /// What they say together.
    pub summary: &'a Summary,
    /// The deviations of all objects at the same places, with the surface that they are drawn on.
    pub map: Option<(&'a DeviationMap, &'a CommonTexture)>,
    /// When and by what the page was made: a sentence.
    pub origin: &'a str,
}

impl PopulationDocuments<'_> {
    /// Writes [`TABLE`], [`PARQUET`], [`FIGURES`], [`PAGE`] and the maps into a folder, which must exist. Links lead to
    /// the results of the scans in [`SCANS`]. docs/batch.md describes the files.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), DocumentError> {
        self.write_tables(folder)?;
        json::write(&folder.join(FIGURES), self.summary)?;
        let maps = self.map.and_then(|(map, texture)| MapDocuments::of(map, texture));
        if let Some(maps) = &maps {
            maps.write(folder)?;
        }
        let page = page::page(self, maps.as_ref(), folder);
        atomic::write(&folder.join(PAGE), page.as_bytes())?;
        Ok(())
    }

    /// Writes the tables alone: what is kept of work that goes on.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write_tables(&self, folder: &Path) -> Result<(), WriteError> {
        let columns = columns::columns(self.rows);
        atomic::write(&folder.join(TABLE), comma_separated(&columns, self.rows.len()).as_bytes())?;
        let path = folder.join(PARQUET);
        let bytes = parquet::parquet(&columns, self.rows.len());
        let bytes = bytes.map_err(|error| WriteError { path: path.clone(), source: io::Error::other(error) })?;
        atomic::write(&path, &bytes)
    }
}

/// The table as text.
fn comma_separated(columns: &[Column], count: usize) -> String {
    let mut table = csv::Table::new(columns.iter().map(|column| column.name.as_str()));
    for row in 0..count {
        table.row(columns.iter().map(|column| match &column.cells {
            Cells::Text(cells) => cells[row].as_deref().map_or(csv::Cell::Empty, csv::Cell::Text),
            Cells::Number(cells) => csv::Cell::number(cells[row]),
            Cells::Whole(cells) => cells[row].map_or(csv::Cell::Empty, |n| csv::Cell::Count(n as usize)),
            Cells::Flag(cells) => cells[row].map_or(csv::Cell::Empty, csv::Cell::Flag),
        }));
    }
    table.into_text()
}
