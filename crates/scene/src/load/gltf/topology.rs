//! Triangle lists, strips and fans as triangles of vertex indices.

/// What the vertices of a primitive form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topology {
    /// Three vertices each.
    List,
    /// Every vertex from the third on forms a triangle with the two before it.
    Strip,
    /// Every vertex from the third on forms a triangle with the one before it and the first.
    Fan,
}

impl Topology {
    /// From a primitive's `mode`; `None` for points, lines and what does not exist.
    pub fn from_mode(mode: u32) -> Option<Self> {
        match mode {
            4 => Some(Self::List),
            5 => Some(Self::Strip),
            6 => Some(Self::Fan),
            _ => None,
        }
    }

    /// The number of triangles that `vertices` vertices form.
    pub fn triangle_count(self, vertices: u64) -> u64 {
        match self {
            Self::List => vertices / 3,
            Self::Strip | Self::Fan => vertices.saturating_sub(2),
        }
    }

    /// The triangles of `vertices`, wound as the specification says.
    pub fn triangles(self, vertices: &[u32]) -> Vec<[u32; 3]> {
        match self {
            Self::List => vertices.as_chunks::<3>().0.to_vec(),
            Self::Strip => {
                let turned = |(i, w): (usize, &[u32])| {
                    if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] }
                };
                vertices.windows(3).enumerate().map(turned).collect()
            }
            Self::Fan => {
                let Some((first, rest)) = vertices.split_first() else { return Vec::new() };
                rest.windows(2).map(|w| [w[0], w[1], *first]).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_are_wound_as_the_specification_says() {
        let v = [10, 11, 12, 13, 14];
        assert_eq!(Topology::Strip.triangles(&v), [[10, 11, 12], [11, 13, 12], [12, 13, 14]]);
        assert_eq!(Topology::Fan.triangles(&v), [[11, 12, 10], [12, 13, 10], [13, 14, 10]]);
        assert_eq!(Topology::List.triangles(&v), [[10, 11, 12]]);
    }

    #[test]
    fn counts_match_for_all_lengths() {
        for topology in [Topology::List, Topology::Strip, Topology::Fan] {
            for n in 0..8u32 {
                let vertices: Vec<u32> = (0..n).collect();
                let count = topology.triangles(&vertices).len() as u64;
                assert_eq!(count, topology.triangle_count(n.into()), "{topology:?} {n}");
            }
        }
    }
}
