//! Why a place has a distance, or has none.

use super::Deviations;

/// The class of a texel or of a point of the scan. The numbers are those of `class` in files for other tools, and are
/// never used for anything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Class {
    /// No scan was met within the maximum distance.
    NoData = 0,
    /// It has a distance.
    Measured = 1,
    /// A hole of the scan that was closed lies there.
    Filled = 2,
    /// The surface is inside of the model's own material, where no scan can be.
    Buried = 3,
    /// The scan shows empty space there.
    Contradicted = 4,
    /// What was met belongs to another place of the model.
    Ambiguous = 5,
    /// A point of the scan that is farther from all surface than the maximum distance.
    Beyond = 6,
    /// A point of the scan near to such surface only as faces another way.
    FacingAway = 7,
}

impl Class {
    /// All classes in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::NoData,
        Self::Measured,
        Self::Filled,
        Self::Buried,
        Self::Contradicted,
        Self::Ambiguous,
        Self::Beyond,
        Self::FacingAway,
    ];

    /// The number in files.
    #[must_use]
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Its meaning in a few words.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::NoData => "no data",
            Self::Measured => "measured",
            Self::Filled => "filled hole",
            Self::Buried => "buried",
            Self::Contradicted => "empty space",
            Self::Ambiguous => "ambiguous",
            Self::Beyond => "beyond the maximum distance",
            Self::FacingAway => "surface faces another way",
        }
    }
}

impl Deviations {
    /// The class of texel i.
    #[must_use]
    pub fn class(&self, i: usize) -> Class {
        if self.is_buried(i) {
            Class::Buried
        } else if self.is_filled(i) {
            Class::Filled
        } else if self.is_contradicted(i) {
            Class::Contradicted
        } else if self.is_ambiguous(i) {
            Class::Ambiguous
        } else if self.signed(i).is_nan() {
            Class::NoData
        } else {
            Class::Measured
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Class;

    #[test]
    fn classes_stand_at_their_numbers() {
        for (number, class) in Class::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(class.code()), number, "{class:?}");
        }
    }
}
