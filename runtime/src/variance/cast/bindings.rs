//! Arrays that are too large for one binding of a GPU, split into several.

use std::fmt::Write;

/// How an array is split: every binding but the last holds `each` of its elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Split {
    pub(super) each: usize,
    pub(super) bindings: usize,
}

/// The shader without the scan's bindings.
const SHADER: &str = include_str!("cast.wgsl");

/// Bindings before those of the scan.
pub(super) const FIRST: usize = 3;

impl Split {
    /// Splits `count` elements of `size` bytes into bindings of at most `limit` bytes.
    pub(super) fn new(count: usize, size: usize, limit: u64) -> Split {
        let each = usize::try_from(limit).unwrap_or(usize::MAX) / size;
        let each = each.clamp(1, count.max(1));
        Split { each, bindings: count.div_ceil(each).max(1) }
    }

    /// The bytes of each binding of an array whose elements have `size` bytes.
    pub(super) fn pieces<'a>(&self, bytes: &'a [u8], size: usize) -> impl Iterator<Item = &'a [u8]> {
        bytes.chunks(self.each * size)
    }
}

/// The shader for a number of bindings of nodes and of triangles: element i of an array is in binding i / each.
pub(super) fn shader(nodes: usize, blocks: usize) -> String {
    let mut source = SHADER.to_owned();
    let mut binding = FIRST;
    let arrays = [
        ("nodes", nodes, "Node", "fn node_at(i: u32) -> Node", "", "setup.nodes_each"),
        ("blocks", blocks, "Block", "fn corner_at(i: u32, k: u32) -> vec4f", ".corners[k]", "setup.blocks_each"),
    ];
    for (name, count, element, signature, part, each) in arrays {
        for piece in 0..count {
            let _ =
                writeln!(source, "@group(0) @binding({binding}) var<storage, read> {name}{piece}: array<{element}>;");
            binding += 1;
        }
        let _ = writeln!(source, "{signature} {{");
        for piece in 0..count - 1 {
            let _ = writeln!(
                source,
                "  if i < {}u * {each} {{ return {name}{piece}[i - {piece}u * {each}]{part}; }}",
                piece + 1
            );
        }
        let last = count - 1;
        let _ = writeln!(source, "  return {name}{last}[i - {last}u * {each}]{part};\n}}");
    }
    source
}

#[cfg(test)]
mod tests {
    use super::{Split, shader};

    #[test]
    fn arrays_are_cut_as_seldom_as_possible() {
        assert_eq!(Split::new(10, 32, 1000), Split { each: 10, bindings: 1 });
        assert_eq!(Split::new(10, 32, 100), Split { each: 3, bindings: 4 });
        assert_eq!(Split::new(9, 32, 96), Split { each: 3, bindings: 3 });
        assert_eq!(Split::new(0, 32, 96).bindings, 1);
        let bytes = [0u8; 10 * 32];
        assert_eq!(Split::new(10, 32, 100).pieces(&bytes, 32).map(<[u8]>::len).collect::<Vec<_>>(), [96, 96, 96, 32]);
        // 10 million triangles in leaves of three, and the default limits of WebGPU: 128 MiB a binding, eight bindings.
        let limit = 128 << 20;
        assert!(Split::new(6_700_000, 32, limit).bindings + Split::new(3_350_000, 144, limit).bindings <= 6);
    }

    #[test]
    fn every_binding_has_its_own_number() {
        let source = shader(2, 3);
        for k in 0..8 {
            assert_eq!(source.matches(&format!("@binding({k})")).count(), 1, "{k}");
        }
        assert!(source.contains("return blocks2[i - 2u * setup.blocks_each].corners[k];"));
    }
}
