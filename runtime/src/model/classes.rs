//! Classes of texels that take long to look at, from coarse to fine.

use super::Texels;
use rayon::prelude::*;

/// The stride from which on texels at the edges of charts are taken to be as those beside them that are known.
const FINE: u32 = 2;

impl Texels {
    /// The class of every texel, of which only some are looked at. Every so many texels of rows and columns are, by
    /// each of the strides in turn: what lies between four of the last turn that are of one part and alike is taken to
    /// be as they are. What is narrower than the first stride may be missed. Where the last one is above 1, texels are
    /// as the next one of their part that is known.
    pub(crate) fn classify<C: Copy + PartialEq + Send + Sync>(
        &self,
        strides: &[u32],
        look: impl Fn(usize) -> C + Sync,
    ) -> Vec<C> {
        let width = self.width as usize;
        // By place in the texture, the part and its class.
        let mut known: Vec<Option<(u32, C)>> = vec![None; width * self.height as usize];
        let mut last = 0;
        for stride in strides.iter().copied() {
            let alike = |i: usize| {
                let [x, y] = self.place(i).map(|c| (c / last * last) as usize);
                let at = |x: usize, y: usize| if x < width { *known.get(y * width + x)? } else { None };
                let far = last as usize;
                let first = at(x, y).filter(|(part, _)| *part == self.part[i])?;
                let others = [at(x + far, y), at(x, y + far), at(x + far, y + far)];
                // At the edges of charts the last texels are as those beside them that are known.
                let is_alike = |other: &Option<_>| other.map_or(last == FINE, |other| other == first);
                others.iter().all(is_alike).then_some(first.1)
            };
            let is_due =
                |i: &usize| known[self.index[*i] as usize].is_none() && self.place(*i).iter().all(|c| c % stride == 0);
            let of_texel = |i: usize| (i, if last == 0 { None } else { alike(i) }.unwrap_or_else(|| look(i)));
            let found: Vec<(usize, C)> = (0..self.len()).into_par_iter().filter(is_due).map(of_texel).collect();
            for (i, class) in found {
                known[self.index[i] as usize] = Some((self.part[i], class));
            }
            last = stride;
        }
        let beside = |i: usize| {
            let [x, y] = self.place(i).map(|c| (c / last * last) as usize);
            let far = last as usize;
            let known = |(x, y): (usize, usize)| {
                let of_part = |(part, _): &(u32, C)| *part == self.part[i];
                if x < width { (*known.get(y * width + x)?).filter(of_part) } else { None }
            };
            [(x, y), (x + far, y), (x, y + far), (x + far, y + far)].into_iter().find_map(known)
        };
        let of_texel = |i: usize| match known[self.index[i] as usize].or_else(|| beside(i)) {
            Some((_, class)) => class,
            None => look(i),
        };
        (0..self.len()).into_par_iter().map(of_texel).collect()
    }
}
