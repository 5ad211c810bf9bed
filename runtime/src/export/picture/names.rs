//! Names of parts on the charts of a texture.

use super::Picture;
use super::legend::Theme;
use crate::export::glyphs::{GLYPH_HEIGHT, draw, draw_upwards, text_width};
use crate::model::Texels;

/// A name with its place on the texture.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::export) struct Name {
    pub(in crate::export) text: String,
    /// Left and upper edge of its box, in texels.
    pub(in crate::export) at: [usize; 2],
    /// Width and height of the box, in texels.
    pub(in crate::export) extent: [usize; 2],
    /// Whether it is written from the bottom to the top.
    pub(in crate::export) is_upwards: bool,
}

/// The free rim about a name, in dots of its letters.
const RIM: usize = 2;

/// The names that find room within what belongs to their parts, in letters of `size` texels a dot: one a part, along
/// rows or, in a tall chart, along columns. A name of several components that has no room is cut to its last one.
pub(in crate::export) fn names(texels: &Texels, size: usize) -> Vec<Name> {
    let (width, height) = (texels.width as usize, texels.height as usize);
    let mut part_at = vec![u32::MAX; width * height];
    let mut boxes = vec![[usize::MAX, usize::MAX, 0, 0]; texels.part_names.len()];
    for i in 0..texels.len() {
        let (part, [x, y]) = (texels.part[i], texels.place(i).map(|n| n as usize));
        part_at[y * width + x] = part;
        if let Some(b) = boxes.get_mut(part as usize) {
            *b = [b[0].min(x), b[1].min(y), b[2].max(x + 1), b[3].max(y + 1)];
        }
    }
    let is_of = |x: usize, y: usize, part: u32| part_at.get(y * width + x).is_some_and(|p| *p == part);
    let fits = |part: u32, [x, y]: [usize; 2], [wide, high]: [usize; 2]| {
        let share = |k: usize, extent: usize, n: usize| k * (extent - 1) / n;
        // Samples are enough: what belongs to a part is mostly a rectangle.
        (0..=8).all(|i| (0..=2).all(|j| is_of(x + share(i, wide, 8), y + share(j, high, 2), part)))
    };
    let high = (GLYPH_HEIGHT + 2 * RIM) * size;
    let find = |part: usize, text: &str| {
        let [left, top, right, bottom] = boxes[part];
        let wide = text_width(text, size) + 2 * RIM * size;
        [([wide, high], false), ([high, wide], true)].into_iter().find_map(|(extent, is_upwards)| {
            let rows = (top..bottom.saturating_sub(extent[1] - 1)).step_by(size);
            let places =
                rows.flat_map(|y| (left..right.saturating_sub(extent[0] - 1)).step_by(8 * size).map(move |x| [x, y]));
            // A part of scattered pieces is not searched without end.
            let at = places.take(4096).find(|at| fits(part as u32, *at, extent))?;
            Some(Name { text: text.to_owned(), at, extent, is_upwards })
        })
    };
    let name = |(part, name): (usize, &String)| {
        let last = name.rsplit('.').next().unwrap_or_default();
        find(part, name).or_else(|| find(part, last))
    };
    texels.part_names.iter().enumerate().filter(|(_, name)| !name.is_empty()).filter_map(name).collect()
}

/// Draws names, each in a dark box.
pub(super) fn write(picture: &mut Picture, names: &[Name], size: usize) {
    let Theme { paper, ink, .. } = Theme::DARK;
    for Name { text, at: [x, y], extent: [wide, high], is_upwards } in names {
        picture.fill(*x, *y, *wide, *high, paper);
        let draw = if *is_upwards { draw_upwards } else { draw };
        draw(picture, x + RIM * size, y + RIM * size, size, ink, text);
    }
}

#[cfg(test)]
mod tests {
    use super::names;
    use crate::model::Texels;

    /// Rectangles of texels (left, top, width, height), a part each.
    fn texels(rectangles: &[([usize; 4], &str)]) -> Texels {
        let (mut index, mut part) = (Vec::new(), Vec::new());
        for (number, ([left, top, width, height], _)) in rectangles.iter().enumerate() {
            for y in *top..top + height {
                index.extend((*left..left + width).map(|x| (y * 256 + x) as u32));
                part.extend(std::iter::repeat_n(number as u32, *width));
            }
        }
        let n = index.len();
        Texels {
            width: 256,
            height: 256,
            index,
            part,
            position: vec![[0.0; 3]; n],
            normal: vec![[0.0, 0.0, 1.0]; n],
            area: vec![1.0; n],
            side: vec![1.0; n],
            part_names: rectangles.iter().map(|(_, name)| (*name).to_owned()).collect(),
        }
    }

    #[test]
    fn names_lie_within_their_charts() {
        let texels = texels(&[
            ([0, 0, 100, 60], "wall"),
            ([104, 0, 24, 120], "wall[1]"),
            ([132, 0, 60, 30], "handle.end"),
            ([196, 0, 20, 20], "no room for it"),
        ]);
        let found = names(&texels, 2);
        let texts: Vec<(&str, bool)> = found.iter().map(|name| (name.text.as_str(), name.is_upwards)).collect();
        assert_eq!(texts, [("wall", false), ("wall[1]", true), ("end", false)]);
        assert_eq!((found[1].at, found[1].extent), ([104, 0], [22, 92]));
    }
}
