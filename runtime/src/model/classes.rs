//! Classes of texels that take long to look at, from coarse to fine.

use super::Texels;
use rayon::prelude::*;

/// Texels of every row and column that are looked at, in turn: what lies between four of the last turn that are alike
/// is as they are. What is narrower than the first may be missed.
const STRIDES: [u32; 3] = [8, FINEST, 1];
const FINEST: u32 = 2;

impl Texels {
    /// The class of every texel, of which only some are looked at: where neighbours of a part are alike, what is
    /// between them is taken to be as they are.
    pub(crate) fn classify<C: Copy + Default + PartialEq + Send + Sync>(
        &self,
        look: impl Fn(usize) -> C + Sync,
    ) -> Vec<C> {
        let width = self.width as usize;
        // By place in the texture, the part and its class.
        let mut known: Vec<Option<(u32, C)>> = vec![None; width * self.height as usize];
        let mut last = 0;
        for stride in STRIDES {
            let alike = |i: usize| {
                let [x, y] = self.place(i).map(|c| (c / last * last) as usize);
                let at = |x: usize, y: usize| if x < width { *known.get(y * width + x)? } else { None };
                let far = last as usize;
                let first = at(x, y).filter(|(part, _)| *part == self.part[i])?;
                let others = [at(x + far, y), at(x, y + far), at(x + far, y + far)];
                // At the edges of charts the last texels are as those beside them that are known.
                let is_alike = |other: &Option<_>| other.map_or(last == FINEST, |other| other == first);
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
        self.index.iter().map(|i| known[*i as usize].map_or_else(C::default, |(_, class)| class)).collect()
    }
}
