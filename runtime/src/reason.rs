//! Errors of the operating system as users know them.

use std::io::{Error, ErrorKind};

/// The reason of a failed access to a file, without the system's number of it. One cause has one wording, whichever
/// command meets it.
#[must_use]
pub fn in_words(error: &Error) -> String {
    match error.kind() {
        ErrorKind::AlreadyExists | ErrorKind::NotADirectory => "there is a file where a folder is needed".to_owned(),
        // Those of this program's own bring their sentence along.
        _ if error.raw_os_error().is_none() && error.get_ref().is_some() => error.to_string(),
        // Without the number of the error in brackets at its end.
        kind => known(kind).map_or_else(|| error.to_string().split(" (os error").take(1).collect(), str::to_owned),
    }
}

/// The same where only the kind is known.
#[must_use]
pub fn of_kind(kind: ErrorKind) -> String {
    known(kind).map_or_else(|| kind.to_string(), str::to_owned)
}

fn known(kind: ErrorKind) -> Option<&'static str> {
    match kind {
        ErrorKind::NotFound => Some("there is no such file or folder"),
        ErrorKind::PermissionDenied => Some("permission denied"),
        ErrorKind::ReadOnlyFilesystem => Some("the disk is read-only"),
        ErrorKind::StorageFull => Some("the disk is full"),
        ErrorKind::QuotaExceeded => Some("the disk quota is used up"),
        ErrorKind::FileTooLarge => Some("the file is larger than the system allows"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_sentences_without_numbers() {
        for (code, expected) in [
            (13, "permission denied"),
            (17, "there is a file where a folder is needed"),
            (20, "there is a file where a folder is needed"),
            (28, "the disk is full"),
            (30, "the disk is read-only"),
            (27, "the file is larger than the system allows"),
            (5, "Input/output error"),
        ] {
            assert_eq!(in_words(&Error::from_raw_os_error(code)), expected);
        }
        assert_eq!(in_words(&Error::other("one's own")), "one's own");
        assert_eq!(in_words(&ErrorKind::StorageFull.into()), "the disk is full");
    }
}
