//! Today, for documents.

use std::time::{SystemTime, UNIX_EPOCH};

/// The date (UTC) as year-month-day. The environment variable SOURCE_DATE_EPOCH (seconds) takes the clock's place, so
/// that documents can be reproduced byte for byte.
pub(crate) fn today() -> String {
    let given = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|s| s.trim().parse::<u64>().ok());
    let seconds = given.unwrap_or_else(|| SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()));
    let (year, month, day) = civil(seconds / 86_400);
    format!("{year}-{month:02}-{day:02}")
}

/// Year, month and day of the days since 1970-01-01 (H. Hinnant, 'chrono-compatible low-level date algorithms',
/// `civil_from_days`): years begin in March, so that the leap day is the last one.
fn civil(days: u64) -> (u64, u64, u64) {
    let days = days.min(3_000_000_000) + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (era * 400 + year + u64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::civil;

    /// Expected values from `date -u -d @SECONDS`.
    #[test]
    fn known_days() {
        assert_eq!(civil(0), (1970, 1, 1));
        assert_eq!(civil(58), (1970, 2, 28));
        assert_eq!(civil(951_782_400 / 86_400), (2000, 2, 29));
        assert_eq!(civil(951_868_800 / 86_400), (2000, 3, 1));
        assert_eq!(civil(1_735_603_200 / 86_400), (2024, 12, 31));
        assert_eq!(civil(4_107_542_400 / 86_400), (2100, 3, 1));
        assert_eq!(civil(u64::MAX).1.clamp(1, 12), civil(u64::MAX).1);
    }
}
