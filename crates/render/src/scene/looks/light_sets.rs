//! The sets of lights that light the surfaces of a scene.
//!
//! Surfaces in nested separators have nearly the same lights, so the sets form a tree: each is a
//! path from a root, one light after the other. A light is stored once. The tree is cut into paths
//! along its largest subtrees, and the lights of a path are neighbors in one list. A set is then at
//! most as many ranges of that list as the logarithm of the number of lights to the base 2 (Sleator
//! and Tarjan, A data structure for dynamic trees, 1983), and one or two in an ordinary scene.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use ivcam_inventor::iv::NodeId;
use ivcam_inventor::traversal::LightList;
use ivcam_inventor::traversal::state::LightElement;

use super::light::Light;

/// The sets of lights of a scene, by number.
#[derive(Debug, Default)]
pub(crate) struct LightSets {
    lights: Vec<Light>,
    /// Ranges of `lights`.
    ranges: Vec<Range<u32>>,
    /// The ranges of each set, as a range of `ranges`.
    sets: Vec<Range<u32>>,
    /// The indices of the lights in the order of their first use.
    by_use: Vec<u32>,
}

impl LightSets {
    /// Returns the lights of a set, in the order of the scene.
    pub(crate) fn of_set(&self, set: u32) -> impl Iterator<Item = &Light> + Clone {
        let ranges = &self.ranges[indices(&self.sets[set as usize])];
        ranges.iter().flat_map(|range| &self.lights[indices(range)])
    }

    /// Returns the number of lights of a set.
    pub(crate) fn count(&self, set: u32) -> usize {
        let ranges = &self.ranges[indices(&self.sets[set as usize])];
        ranges.iter().map(ExactSizeIterator::len).sum()
    }

    /// Marks the lights at the camera of a scene with an extent: see [`Light::placed_at_eye`].
    pub(in crate::scene) fn find_lights_at_eye(&mut self, extent: f32) {
        for light in &mut self.lights {
            *light = light.placed_at_eye(extent);
        }
    }

    /// Whether there are no lights.
    pub(crate) fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Returns all lights in the order of their first use, equal ones once.
    pub(crate) fn different(&self) -> Vec<Light> {
        let mut seen = HashSet::new();
        let lights = self.by_use.iter().map(|&i| self.lights[i as usize]);
        lights.filter(|light| seen.insert(light.bits())).collect()
    }
}

fn indices(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

/// No light: the place before the first light of a path.
const ROOT: u32 = u32::MAX;

/// The tree of the lights of a scene, while it is compiled.
#[derive(Debug, Default)]
pub(in crate::scene) struct LightTree {
    /// The lights, each after the one before it in its sets.
    lights: Vec<TreeLight>,
    /// The light at the end of each list, by the list's address.
    ends: HashMap<usize, u32>,
    /// Copies of lists, so that their addresses cannot be those of other lists.
    kept: Vec<LightList>,
    /// The light at the end of each set.
    sets: Vec<u32>,
    /// The set that ends at each light.
    set_of_end: HashMap<u32, u32>,
}

#[derive(Debug)]
struct TreeLight {
    light: Light,
    node: NodeId,
    /// The light before it, or [`ROOT`].
    before: u32,
}

impl LightTree {
    /// Returns the number of the set of a list of lights. `compile` converts a light that is new.
    pub(in crate::scene) fn set(
        &mut self,
        list: &LightList,
        compile: impl Fn(&LightElement) -> Light,
    ) -> u32 {
        let mut added = Vec::new();
        let mut before = list;
        while let Some((light, rest)) = before.split_last()
            && !self.ends.contains_key(&before.address())
        {
            added.push((before.address(), light));
            before = rest;
        }
        let mut end = self.ends.get(&before.address()).copied().unwrap_or(ROOT);
        if !added.is_empty() {
            self.kept.push(list.clone());
        }
        for (address, light) in added.into_iter().rev() {
            self.lights.push(TreeLight {
                light: compile(light),
                node: light.node,
                before: end,
            });
            end = self.lights.len() as u32 - 1;
            self.ends.insert(address, end);
        }
        let next = self.sets.len() as u32;
        let set = *self.set_of_end.entry(end).or_insert(next);
        if set == next {
            self.sets.push(end);
        }
        set
    }

    /// Returns the number of the set with the most lights.
    pub(in crate::scene) fn largest_set(&self) -> u32 {
        let mut depths = Vec::with_capacity(self.lights.len());
        for light in &self.lights {
            depths.push(1 + depths.get(light.before as usize).copied().unwrap_or(0u32));
        }
        let count = |end: &u32| depths.get(*end as usize).copied().unwrap_or(0);
        let sets = self.sets.iter().enumerate();
        sets.max_by_key(|(_, end)| count(end))
            .map_or(0, |(set, _)| set as u32)
    }

    /// Returns the memory of the lights and sets in bytes, with that of their maps and of the lists
    /// that they were made of.
    pub(in crate::scene) fn bytes(&self) -> u64 {
        const LIGHT: usize = size_of::<TreeLight>() + size_of::<Light>() + 64;
        const LISTED: usize = size_of::<LightElement>() + 32;
        const SET: usize = 64;
        let bytes = self.lights.len() * (LIGHT + LISTED) + self.sets.len() * SET;
        bytes as u64
    }

    /// Returns the number of different nodes among the lights.
    pub(in crate::scene) fn nodes(&self) -> u64 {
        let nodes: HashSet<NodeId> = self.lights.iter().map(|l| l.node).collect();
        nodes.len() as u64
    }

    /// Returns how often each node lights something, from the uses of each set.
    pub(in crate::scene) fn uses(&self, of_sets: &[u64]) -> HashMap<NodeId, u64> {
        let mut counts = vec![0; self.lights.len()];
        for (&end, &count) in self.sets.iter().zip(of_sets) {
            if let Some(own) = counts.get_mut(end as usize) {
                *own += count;
            }
        }
        let mut by_node = HashMap::new();
        for (i, light) in self.lights.iter().enumerate().rev() {
            let count = counts[i];
            if let Some(before) = counts.get_mut(light.before as usize) {
                *before += count;
            }
            *by_node.entry(light.node).or_default() += count;
        }
        by_node
    }

    /// Returns the sets, which are empty if the picture needs no lights.
    pub(in crate::scene) fn finish(self, are_needed: bool) -> LightSets {
        if !are_needed {
            return LightSets {
                sets: vec![0..0; self.sets.len()],
                ..LightSets::default()
            };
        }
        let (heads, order) = self.paths();
        let mut place = vec![0u32; self.lights.len()];
        for (at, &light) in order.iter().enumerate() {
            place[light as usize] = at as u32;
        }
        let mut out = LightSets {
            lights: order
                .iter()
                .map(|&i| self.lights[i as usize].light)
                .collect(),
            ..LightSets::default()
        };
        for &end in &self.sets {
            let first = out.ranges.len();
            let mut end = end;
            while end != ROOT {
                let head = heads[end as usize];
                let range = place[head as usize]..place[end as usize] + 1;
                out.ranges.push(range);
                end = self.lights[head as usize].before;
            }
            out.ranges[first..].reverse();
            out.sets.push(first as u32..out.ranges.len() as u32);
        }
        out.by_use = place;
        out
    }

    /// Cuts the tree into paths. Returns the first light of each light's path, and the lights path
    /// by path.
    fn paths(&self) -> (Vec<u32>, Vec<u32>) {
        let count = self.lights.len();
        let mut sizes = vec![1u32; count];
        // Of the lights after each light, the one with the most lights behind it.
        let mut heavy = vec![ROOT; count];
        for i in (0..count).rev() {
            let before = self.lights[i].before as usize;
            if let Some(&next) = heavy.get(before) {
                sizes[before] += sizes[i];
                if next == ROOT || sizes[next as usize] <= sizes[i] {
                    heavy[before] = i as u32;
                }
            }
        }
        let mut heads = vec![ROOT; count];
        let mut order = Vec::with_capacity(count);
        for i in 0..count as u32 {
            if heads[i as usize] != ROOT {
                continue;
            }
            let mut light = i;
            while light != ROOT {
                heads[light as usize] = i;
                order.push(light);
                light = heavy[light as usize];
            }
        }
        (heads, order)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use ivcam_inventor::iv::NodeId;
    use ivcam_inventor::traversal::state::LightKind;

    use super::*;
    use crate::scene::options::ColorCoding;

    /// Returns a point light at the origin whose intensity is the number of its node.
    fn numbered(number: u32) -> LightElement {
        LightElement {
            kind: LightKind::Point,
            color: Vec3::ONE,
            intensity: number as f32,
            ambient: 0.0,
            position: DVec3::ZERO,
            direction: DVec3::NEG_Z,
            attenuation: Vec3::Z,
            least_divisor: 0.0,
            linear: false,
            radius: f32::INFINITY,
            node: NodeId(number),
        }
    }

    fn numbers(sets: &LightSets, set: u32) -> Vec<u32> {
        sets.of_set(set).map(|l| l.color.x as u32).collect()
    }

    fn compile(light: &LightElement) -> Light {
        Light::new(light, DVec3::ZERO, ColorCoding::Levels)
    }

    /// Makes random lists, each from an earlier one and some lights more, and compares the sets
    /// with plain lists.
    #[test]
    fn the_sets_are_the_lists_in_their_order() {
        let mut lists = vec![(LightList::default(), Vec::new())];
        let mut tree = LightTree::default();
        let mut sets = Vec::new();
        let (mut seed, mut number) = (1u64, 0);
        for _ in 0..300 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let at = (seed >> 33) as usize;
            // Long chains and branches from anywhere.
            let from = if at.is_multiple_of(3) {
                at % lists.len()
            } else {
                lists.len() - 1
            };
            let (mut list, mut plain) = lists[from].clone();
            for _ in 0..at % 4 {
                number += 1;
                list.push(numbered(number));
                plain.push(number);
            }
            sets.push((tree.set(&list, compile), plain.clone()));
            lists.push((list, plain));
        }
        assert_eq!(tree.nodes(), u64::from(number));
        let out = tree.finish(true);
        for (set, plain) in sets {
            assert_eq!(numbers(&out, set), plain);
        }
        let used: Vec<u32> = out.different().iter().map(|l| l.color.x as u32).collect();
        assert_eq!(used.len(), number as usize);
        assert!(out.ranges.len() < 4 * out.sets.len());
    }

    #[test]
    fn a_chain_with_a_light_beside_each_light_has_two_ranges_for_each_set() {
        let mut tree = LightTree::default();
        let mut outer = LightList::default();
        for i in 0..1000 {
            let mut inner = outer.clone();
            inner.push(numbered(2 * i));
            tree.set(&inner, compile);
            outer.push(numbered(2 * i + 1));
        }
        let sets = tree.finish(true);
        assert_eq!((sets.lights.len(), sets.sets.len()), (1999, 1000));
        assert!(sets.ranges.len() <= 2000, "{}", sets.ranges.len());
        assert_eq!(numbers(&sets, 999).len(), 1000);
    }

    #[test]
    fn equal_lights_are_listed_once_and_none_without_need() {
        let mut tree = LightTree::default();
        let list: LightList = [5, 3, 5].map(numbered).into_iter().collect();
        assert_eq!(tree.set(&list, compile), 0);
        assert_eq!(tree.set(&LightList::default(), compile), 1);
        assert_eq!(tree.set(&list.clone(), compile), 0);
        let sets = tree.finish(true);
        let different: Vec<f32> = sets.different().iter().map(|l| l.color.x).collect();
        assert_eq!(different, [5.0, 3.0]);
        assert!(numbers(&sets, 1).is_empty());
        let mut tree = LightTree::default();
        tree.set(&list, compile);
        assert!(numbers(&tree.finish(false), 0).is_empty());
    }
}
