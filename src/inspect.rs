//! `gmlc inspect`.
