//! How much of the distances between two surfaces the differences of parameters explain.

use super::parameters::ParameterDifference;
use super::prepared::Prepared;
use super::rigid::RigidParts;
use crate::model::PartSensitivities;
use crate::variance::MeasureError;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// How the distances from A to B follow from the differences of their parameters, by the derivatives of A's surface:
/// parameter k, which differs by D_k, moves a place by n . dM/dx_k D_k along the normal. The distances are the sum of
/// these movements where the surface is linear in the parameters, and so are the shares. Where B was aligned, movements
/// are those without the motions of the whole that are nearest to them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExplainedDifference {
    /// Root mean square of the distances of the places that were looked at. Millimetres.
    pub rms: f64,
    /// Root mean square of what remains of them without the movements.
    pub remaining: f64,
    /// The share of their mean square that vanishes.
    pub share: f64,
    /// The movement by each parameter, the largest share first.
    pub parameters: Vec<Contribution>,
    /// The same of every part of A that has a counterpart.
    pub parts: Vec<PartExplained>,
}

/// How the distances of a part follow from the differences of parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartExplained {
    /// Name of the part.
    pub name: String,
    /// As above.
    pub rms: f64,
    /// As above.
    pub remaining: f64,
    /// As above; `null` where the part lies where B has it, so that there is nothing to explain.
    pub share: Option<f64>,
    /// The movement by each parameter of the part, the largest share first.
    pub parameters: Vec<Contribution>,
}

/// The movement of the surface by the difference of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contribution {
    /// Name of the parameter.
    pub name: String,
    /// Root mean square of the movement along the normal. Millimetres.
    pub movement: f64,
    /// Its share of the distances: the mean of the product of both over the mean square of the distances. Those of all
    /// parameters add up to the share of all where movements and distances agree; below zero it moves the surface
    /// against the difference. Parts count that are where the derivatives say; `null` where none is, so that nothing is
    /// said of it.
    pub share: Option<f64>,
}

/// Sums over places for one parameter, weighted by area.
#[derive(Clone, Copy, Default)]
struct Movement {
    /// Of the squares of the movement.
    square: f64,
    /// Of its products with the distances, of parts that are where the derivatives say.
    product: f64,
    /// Whether there are such parts.
    is_linear: bool,
}

/// Sums over places, weighted by area.
#[derive(Clone, Default)]
struct Sums {
    area: f64,
    /// Of the squares of the distances.
    distances: f64,
    /// Of the squares of what remains.
    remaining: f64,
    movements: Vec<Movement>,
}

impl Sums {
    fn none(parameters: usize) -> Self {
        Self { movements: vec![Movement::default(); parameters], ..Self::default() }
    }

    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.distances += other.distances;
        self.remaining += other.remaining;
        for (sum, other) in self.movements.iter_mut().zip(&other.movements) {
            sum.square += other.square;
            sum.product += other.product;
            sum.is_linear |= other.is_linear;
        }
    }

    fn rms(&self, square: f64) -> f64 {
        (square / self.area.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// None where the distances are rounding.
    fn share(&self, of: f64, rounding: f64) -> Option<f64> {
        (self.rms(self.distances) > rounding).then(|| of / self.distances)
    }

    fn contributions(&self, differences: &[&ParameterDifference], rounding: f64) -> Vec<Contribution> {
        let all = differences.iter().zip(&self.movements).filter(|(_, movement)| self.rms(movement.square) > rounding);
        let mut all: Vec<Contribution> = all
            .map(|(difference, movement)| Contribution {
                name: difference.name.clone(),
                movement: self.rms(movement.square),
                share: self.share(movement.product, rounding).filter(|_| movement.is_linear),
            })
            .collect();
        all.sort_by(|a, b| b.share.unwrap_or(f64::NEG_INFINITY).total_cmp(&a.share.unwrap_or(f64::NEG_INFINITY)));
        all
    }
}

/// Distances that are rounding, as a fraction of the surface's diagonal.
const ROUNDING: f64 = 1e-8;

/// None where A is no model, or no parameter differs. `distances` are those of A's texels, NaN where there is none;
/// `rigid` is what an alignment has taken back.
pub(super) fn explain(
    a: &Prepared<'_>,
    distances: &[f64],
    differences: &[ParameterDifference],
    rigid: Option<&RigidParts>,
) -> Result<Option<ExplainedDifference>, MeasureError> {
    let differences: Vec<&ParameterDifference> = differences.iter().filter(|d| d.difference != 0.0).collect();
    let Some(sensitivities) = a.surface.sensitivities()?.filter(|_| !differences.is_empty()) else { return Ok(None) };
    let rounding = ROUNDING * a.bounds().diagonal();
    let places: Vec<Option<usize>> = sensitivities
        .parameters
        .iter()
        .map(|(name, _)| differences.iter().position(|difference| difference.name == *name))
        .collect();
    let mut all = Sums::none(differences.len());
    let mut parts = Vec::new();
    for (patch, part) in sensitivities.parts.iter().enumerate() {
        let sums = of_part(a, patch, part, distances, &differences, &places, rigid);
        all.add(&sums);
        if sums.area > 0.0 {
            parts.push(PartExplained {
                name: a.surface.texels.part_names[patch].clone(),
                rms: sums.rms(sums.distances),
                remaining: sums.rms(sums.remaining),
                share: sums.share(sums.distances - sums.remaining, rounding),
                parameters: sums.contributions(&differences, rounding),
            });
        }
    }
    let share = all.share(all.distances - all.remaining, rounding);
    Ok(share.map(|share| ExplainedDifference {
        rms: all.rms(all.distances),
        remaining: all.rms(all.remaining),
        share,
        parameters: all.contributions(&differences, rounding),
        parts,
    }))
}

/// A parameter that differs and moves a part.
struct Moving {
    /// Its number in the model, and that of its difference.
    parameter: usize,
    difference: usize,
    /// Its column in the part's derivatives, where these depend on it.
    column: Option<usize>,
    /// Whether the part is where the derivatives say.
    is_linear: bool,
}

/// `places` are the differences of the model's parameters, by their numbers.
fn of_part(
    a: &Prepared<'_>,
    patch: usize,
    part: &PartSensitivities,
    distances: &[f64],
    differences: &[&ParameterDifference],
    places: &[Option<usize>],
    rigid: Option<&RigidParts>,
) -> Sums {
    let mut sums = Sums::none(differences.len());
    let texels = &a.surface.texels;
    let of_patch = texels.part.iter().filter(|p| **p as usize == patch).count();
    // Every place stands for as many texels.
    let stands_for = of_patch as f64 / part.texels.len().max(1) as f64;
    let active = part.active.len();
    let is_linear = |parameter: usize, difference: usize| {
        a.surface.parametrised.as_ref().is_some_and(|model| {
            let mut x = model.reach.x.clone();
            x[parameter] += differences[difference].difference;
            model.reach.is_linear(patch, parameter, &x).unwrap_or(false)
        })
    };
    // An alignment also moves parts that do not depend on a parameter.
    let moves = |(parameter, difference): (usize, &Option<usize>)| {
        let difference = (*difference)?;
        let column = part.active.iter().position(|active| *active == parameter);
        let is_linear = column.is_none() || is_linear(parameter, difference);
        (column.is_some() || rigid.is_some()).then_some(Moving { parameter, difference, column, is_linear })
    };
    let moving: Vec<Moving> = places.iter().enumerate().filter_map(moves).collect();
    for (k, texel) in part.texels.iter().enumerate().filter(|(_, texel)| !distances[**texel].is_nan()) {
        let distance = distances[*texel];
        let weight = stands_for * f64::from(texels.area[*texel]).max(0.0);
        let normal = DVec3::from(part.normals[k]);
        let mut left = distance;
        for &Moving { parameter, difference, column, is_linear } in &moving {
            let derivative = column.map_or(DVec3::ZERO, |column| part.derivatives[k * active + column].into());
            let place = DVec3::from(texels.position[*texel]);
            let taken_back = rigid.map_or(DVec3::ZERO, |rigid| rigid.movement(parameter, place));
            let along = differences[difference].difference * normal.dot(derivative - taken_back);
            let movement = &mut sums.movements[difference];
            movement.square += weight * along * along;
            if is_linear {
                movement.is_linear = true;
                movement.product += weight * along * distance;
                left -= along;
            }
        }
        sums.area += weight;
        sums.distances += weight * distance * distance;
        sums.remaining += weight * left * left;
    }
    // A surface that is nearer to B where it is has not gone where its derivatives say: it has moved by more than its
    // own curvature allows, or B's does.
    if sums.remaining > sums.distances {
        sums.remaining = sums.distances;
        sums.movements.iter_mut().for_each(|m| (m.product, m.is_linear) = (0.0, false));
    }
    sums
}
