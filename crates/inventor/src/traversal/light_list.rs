//! The lights that are in force, in a list that shares its beginning with other lists.
//!
//! Each separator may add a light to the lights before it. A list of its own for each would take
//! memory that grows with the square of the number of lights; here a light is stored once.

use std::fmt;
use std::sync::Arc;

use super::state::LightElement;

/// A list of lights. A copy shares all of them.
#[derive(Clone, Default)]
pub struct LightList {
    last: Option<Arc<ListLink>>,
}

/// A light, and the list before it.
struct ListLink {
    light: LightElement,
    before: LightList,
}

impl LightList {
    /// Whether there are no lights.
    pub fn is_empty(&self) -> bool {
        self.last.is_none()
    }

    /// Adds a light at the end.
    pub fn push(&mut self, light: LightElement) {
        let before = std::mem::take(self);
        self.last = Some(Arc::new(ListLink { light, before }));
    }

    /// Returns the last light and the list before it.
    pub fn split_last(&self) -> Option<(&LightElement, &Self)> {
        let link = self.last.as_deref()?;
        Some((&link.light, &link.before))
    }

    /// Returns the lights from the last to the first.
    pub fn backward(&self) -> impl Iterator<Item = &LightElement> {
        let mut list = self;
        std::iter::from_fn(move || {
            let (light, before) = list.split_last()?;
            list = before;
            Some(light)
        })
    }

    /// Returns a number that two lists share only if they are copies of each other, or if the one
    /// with which it was shared no longer exists. It is 0 for the empty list.
    pub fn address(&self) -> usize {
        self.last
            .as_ref()
            .map_or(0, |last| Arc::as_ptr(last) as usize)
    }
}

impl FromIterator<LightElement> for LightList {
    fn from_iter<I: IntoIterator<Item = LightElement>>(lights: I) -> Self {
        let mut list = Self::default();
        lights.into_iter().for_each(|light| list.push(light));
        list
    }
}

impl Drop for LightList {
    /// Drops the links one after the other: a long list dropped by recursion would overflow the
    /// stack.
    fn drop(&mut self) {
        let mut last = self.last.take();
        while let Some(link) = last {
            let mut link = Arc::into_inner(link);
            last = link.as_mut().and_then(|link| link.before.last.take());
        }
    }
}

impl fmt::Debug for LightList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.backward()).finish()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::iv::NodeId;
    use crate::traversal::state::LightKind;

    /// Returns a point light at the origin with a number for its node.
    fn numbered(number: u32) -> LightElement {
        LightElement {
            kind: LightKind::Point,
            color: Vec3::ONE,
            intensity: 1.0,
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

    #[test]
    fn lists_share_their_beginning_and_grow_apart() {
        let base: LightList = [1, 2].map(numbered).into_iter().collect();
        let mut inner = base.clone();
        assert_eq!(inner.address(), base.address());
        inner.push(numbered(3));
        let nodes = |list: &LightList| list.backward().map(|l| l.node.0).collect::<Vec<_>>();
        assert_eq!(nodes(&inner), [3, 2, 1]);
        assert_eq!(nodes(&base), [2, 1]);
        assert_ne!(inner.address(), base.address());
        assert!(LightList::default().is_empty() && !base.is_empty());
    }

    #[test]
    fn a_list_of_a_million_lights_is_dropped_without_recursion() {
        let mut list = LightList::default();
        (0..1_000_000).for_each(|i| list.push(numbered(i)));
        let copy = list.clone();
        drop(list);
        assert_eq!(copy.backward().count(), 1_000_000);
    }
}
