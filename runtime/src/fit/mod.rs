//! Parameters and pose from a scan.
