//! The virtual scanner's properties.

use super::error::SimulationError;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// What the scanner is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Range images from views all around, merged into one layer of triangles.
    #[default]
    StructuredLight,
    /// A terrestrial scanner on some stations: grids of azimuth and elevation, which stay apart.
    Panorama,
    /// A scanner that is led around the object by hand: line profiles from many places.
    HandHeld,
    /// Computed tomography: the whole surface, also what no ray reaches, with noise along the normals.
    Ct,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::StructuredLight, Self::Panorama, Self::HandHeld, Self::Ct];

    /// Its name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::StructuredLight => "structured-light",
            Self::Panorama => "panorama",
            Self::HandHeld => "hand-held",
            Self::Ct => "ct",
        }
    }

    /// Whether its scans have points only.
    #[must_use]
    pub fn is_of_points(self) -> bool {
        matches!(self, Self::Panorama | Self::HandHeld)
    }
}

/// The properties of the scanner, its surroundings, and the pose and the holes of the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scanner {
    /// What it is.
    pub kind: Kind,
    /// Whether the result has points only, those of every station apart.
    pub cloud: bool,
    /// View points of structured light, spread evenly over the sphere around the object.
    pub views: usize,
    /// Stations of a panorama, around the object; not used where `places` has any.
    pub stations: usize,
    /// Places of a panorama's stations in the object's own coordinates. Millimetres.
    pub places: Vec<[f64; 3]>,
    /// Mean distance of neighbouring points on the object. Millimetres.
    pub spacing: f64,
    /// Standard deviation of the range noise, along the view direction (with `ct` along the normal). Millimetres.
    pub noise: f64,
    /// Growth of the standard deviation with the range r, as a fraction of it: sqrt(noise^2 + (`noise_range` r)^2).
    pub noise_range: f64,
    /// Whether the standard deviation is divided by the cosine of the incidence angle.
    pub noise_angle: bool,
    /// Length L of the correlated share of the noise, whose correlation at a distance d on the object is
    /// exp(-d^2 / (2 L^2)). Millimetres; 0 for white noise.
    pub correlation: f64,
    /// Share of the noise's variance that is correlated, where `correlation` is not 0.
    pub correlated: f64,
    /// Diameter of the beam: where it meets two surfaces, the range is between them. Millimetres; 0 for none.
    pub beam: f64,
    /// Fraction of the points of the scan that are outliers.
    pub outliers: f64,
    /// Outliers are off by up to this, evenly, towards or away from the scanner. Millimetres.
    pub outlier_range: f64,
    /// Fraction of the rays that meet a surface and return no point.
    pub dropouts: f64,
    /// Largest angle between view direction and surface normal at which the scanner sees anything. Radians.
    pub max_incidence: f64,
    /// Whether the object stands on a table.
    pub table: bool,
    /// Boxes and balls that stand beside the object.
    pub clutter: usize,
    /// Holes to punch.
    pub holes: usize,
    /// Radius of the holes. Millimetres.
    pub hole_radius: f64,
    /// Whether the object is put into a random pose.
    pub random_pose: bool,
    /// The pose's translation is drawn from a cube of this half side. Millimetres.
    pub reach: f64,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Default for Scanner {
    fn default() -> Self {
        Self {
            kind: Kind::StructuredLight,
            cloud: false,
            views: 24,
            stations: 4,
            places: Vec::new(),
            spacing: 0.8,
            noise: 0.3,
            noise_range: 0.0,
            noise_angle: false,
            correlation: 0.0,
            correlated: 0.5,
            beam: 0.0,
            outliers: 0.001,
            outlier_range: 20.0,
            dropouts: 0.002,
            max_incidence: 75_f64.to_radians(),
            table: false,
            clutter: 0,
            holes: 0,
            hole_radius: 5.0,
            random_pose: true,
            reach: 100.0,
            seed: 0,
        }
    }
}

impl Scanner {
    pub(super) fn check(&self) -> Result<(), SimulationError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let not_negative = |x: f64| x >= 0.0 && x.is_finite();
        let is_part = |x: f64| (0.0..=1.0).contains(&x);
        let stations = self.places.len().max(self.stations);
        let far = self.places.iter().flatten().copied().find(|c| !(c.abs() <= 1e9));
        let options = [
            ("number of views", self.views as f64, self.views >= 1 && self.views <= 10_000, "between 1 and 10000"),
            ("number of stations", stations as f64, (1..=10_000).contains(&stations), "between 1 and 10000"),
            ("place", far.unwrap_or_default(), far.is_none(), "within 1e9 mm"),
            ("spacing", self.spacing, positive(self.spacing), "positive"),
            ("noise", self.noise, not_negative(self.noise), "zero or positive"),
            ("noise of the range", self.noise_range, is_part(self.noise_range), "between 0 and 1"),
            ("length of correlation", self.correlation, not_negative(self.correlation), "zero or positive"),
            ("share of correlated noise", self.correlated, is_part(self.correlated), "between 0 and 1"),
            ("diameter of the beam", self.beam, (0.0..1e9).contains(&self.beam), "zero or positive"),
            ("fraction of outliers", self.outliers, is_part(self.outliers), "between 0 and 1"),
            ("fraction of dropouts", self.dropouts, is_part(self.dropouts), "between 0 and 1"),
            ("outlier range", self.outlier_range, (0.0..1e9).contains(&self.outlier_range), "zero or positive"),
            (
                "largest incidence angle",
                self.max_incidence,
                self.max_incidence > 0.0 && self.max_incidence < FRAC_PI_2,
                "between 0 and 90 degrees",
            ),
            ("number of objects beside", self.clutter as f64, self.clutter <= 1000, "at most 1000"),
            ("number of holes", self.holes as f64, self.holes <= 100_000, "at most 100000"),
            ("hole radius", self.hole_radius, (0.0..1e9).contains(&self.hole_radius), "zero or positive"),
            ("reach", self.reach, (0.0..1e9).contains(&self.reach), "zero or positive"),
        ];
        match options.into_iter().find(|option| !option.2) {
            Some((option, value, _, range)) => Err(SimulationError::Option { option, value, range }),
            None => Ok(()),
        }
    }

    pub(super) fn random(&self, stream: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream);
        random
    }

    pub(super) fn least_cosine(&self) -> f64 {
        self.max_incidence.cos()
    }
}
