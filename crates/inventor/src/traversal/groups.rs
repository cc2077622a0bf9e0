//! Groups that select among their children, repeat them, or turn them to the camera.

use glam::{DMat4, DVec3};
use ivcam_base::diag::Diagnostic;

use super::copies::{Copies, Grid};
use super::frame::WalkFrame;
use super::state::Language;
use super::visitor::{Instance, Visitor};
use super::walk::Walk;
use crate::grammar::{
    Class, billboard, blinker, level_of_detail, lod, path, path_switch, switch_node, vrml97_group,
    vrml97_lod, vrml97_switch_node,
};
use crate::iv::{NodeId, NodeRef};
use crate::pose::Projection;

impl<'a, V: Visitor<'a>> Walk<'a, '_, V> {
    /// Returns the children among which a switch or a level of detail selects.
    fn choices(node: NodeRef<'a>) -> &'a [NodeId] {
        [
            vrml97_switch_node::CHOICE,
            vrml97_lod::LEVEL,
            vrml97_group::CHILDREN,
        ]
        .map(|field| node.get_nodes(field))
        .into_iter()
        .find(|list| !list.is_empty())
        .unwrap_or(&node.data().children)
    }

    /// Visits one child of a list, if it exists.
    fn pick(&mut self, list: &'a [NodeId], index: usize) {
        if let Some(&id) = list.get(index) {
            self.stack.push(WalkFrame::Visit(id));
        }
    }

    /// Walks the children that a `Switch` selects.
    pub(super) fn switch(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        let vrml97 = node.find(vrml97_switch_node::WHICH_CHOICE);
        if vrml97.is_some() {
            self.keep_state();
        }
        let mut which = vrml97.unwrap_or_else(|| node.get(switch_node::WHICH_CHILD));
        if which == -2 {
            which = self.state.switch;
            if which >= 0 && !list.is_empty() {
                which %= list.len() as i32;
            }
        }
        self.state.switch = which;
        match which {
            -3 => self.stack.push(WalkFrame::List { list, next: 0 }),
            0.. => self.pick(list, which as usize),
            _ => {}
        }
    }

    /// Walks the child that a `Blinker` shows at this time. It shows all children in turn within
    /// 1/speed seconds; a single child is hidden for the first half of that time. At time 0, and
    /// when it is off, it shows the child that the file selects, or the first one if the file
    /// selects none (measured in Coin); a single child that is not selected is hidden at time 0.
    pub(super) fn blinker(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        if self.options.all_levels {
            self.stack.push(WalkFrame::List { list, next: 0 });
            return;
        }
        let stated = node.get(blinker::WHICH_CHILD);
        let speed = f64::from(node.get(blinker::SPEED));
        let round = speed * self.time;
        let share = round - round.floor();
        let which = match (node.get(blinker::ON), list.len()) {
            (true, 1) if round > 0.0 => libm::floor(2.0 * share) as i32 - 1,
            (true, n) if round > 0.0 => libm::floor(share * n as f64) as i32,
            (true, 1) => stated,
            _ => stated.max(0),
        };
        self.state.switch = which;
        if let Ok(index) = usize::try_from(which) {
            self.pick(list, index);
        }
    }

    /// Walks the children of a `PathSwitch` if the path to the node ends with the path in its
    /// field.
    pub(super) fn path_switch(&mut self, node: NodeRef<'a>) {
        let Some(path) = node.get_node(path_switch::PATH) else {
            return;
        };
        let mut wanted: Vec<NodeId> = path.get_nodes(path::HEAD).to_vec();
        for &index in path.get(path::INDICES) {
            let below = wanted.last().map(|&id| self.document.node(id));
            let child = below.and_then(|n| n.data().children.get(usize::try_from(index).ok()?));
            let Some(&child) = child else {
                return;
            };
            wanted.push(child);
        }
        let above: Vec<NodeId> = self
            .stack
            .iter()
            .filter_map(|frame| match frame {
                WalkFrame::Leave(id) if *id != node.id => Some(*id),
                _ => None,
            })
            .collect();
        if !wanted.is_empty() && above.ends_with(&wanted) {
            self.children(node);
        }
    }

    /// Walks the children at every place of a grid, with x fastest and z slowest. As in Inventor,
    /// every copy begins with the state at the array itself. Copies beyond the limit of visits are
    /// left out.
    pub(super) fn array(&mut self, node: NodeRef<'a>) {
        let grid = Grid::from_node(node);
        let part = Instance::Grid(node, grid);
        if self.visitor.instance(part, &self.state) {
            return;
        }
        let most = self.options.max_visits;
        let [a, b, c] = grid.counts;
        if grid.len() > most {
            let name = node.class_name();
            let diagnostic = Diagnostic::warning(format!(
                "this `{name}` makes {a} x {b} x {c} copies; the first {most} are drawn"
            ));
            let help = "`--scene-limit visits=N` raises this";
            self.report_once(node, diagnostic.with_help(help));
        } else if grid.is_empty() {
            let name = node.class_name();
            let diagnostic = Diagnostic::warning(format!(
                "this `{name}` makes {a} x {b} x {c} copies, so it draws nothing"
            ));
            let help = "`numElements1`, `numElements2` and `numElements3` are at least 1";
            self.report_once(node, diagnostic.with_help(help));
        }
        self.copies(node, Copies::Grid(grid, grid.len().min(most)));
    }

    /// Walks the children once for each matrix of a `MultipleCopy`.
    pub(super) fn multiple_copy(&mut self, node: NodeRef<'a>) {
        self.copies(node, Copies::multiple(node));
    }

    /// Walks a node's children once for each copy, in order.
    fn copies(&mut self, node: NodeRef<'a>, copies: Copies<'a>) {
        self.stack.push(WalkFrame::Copies {
            node,
            copies,
            next: 0,
            visits: self.visits,
        });
    }

    /// Walks a node's children for the copy with a number. A copy without nodes counts as one
    /// visit, so that the limit of visits also ends an array of nothing.
    pub(super) fn copy(&mut self, node: NodeRef<'a>, copies: Copies<'a>, number: u64, before: u64) {
        if number > 0 && self.visits == before {
            self.visits += 1;
        }
        let Some(matrix) = copies.get(number) else {
            return;
        };
        self.stack.push(WalkFrame::Copies {
            node,
            copies,
            next: number + 1,
            visits: self.visits,
        });
        self.keep_state();
        self.state.multiply(matrix);
        self.state.switch = i32::try_from(number).unwrap_or(i32::MAX);
        if self.visitor.instance(Instance::Copy(node), &self.state) {
            self.visits += 1;
        } else {
            self.children(node);
        }
    }

    /// Reports a diagnostic at the place of a node, once for each node.
    fn report_once(&mut self, node: NodeRef<'a>, mut diagnostic: Box<Diagnostic>) {
        if !self.reported.insert(node.id) {
            return;
        }
        if let Some(source) = node.source() {
            diagnostic = diagnostic.at(source, node.span());
        }
        self.visitor.report(diagnostic);
    }

    /// Walks the child that an `LOD` selects by the distance from the eye to its center. Inventor
    /// measures it in world space, VRML 1.0 and VRML97 (6.26) in the node's own space.
    pub(super) fn lod(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        if self.options.all_levels {
            self.stack.push(WalkFrame::List { list, next: 0 });
            return;
        }
        let ranges = node.get(lod::RANGE);
        let center = node.get(lod::CENTER).as_dvec3();
        let world_from_object = self.state.world_from_object;
        let is_vrml97 = node.known_class().is_some_and(Class::is_vrml97);
        let is_local = is_vrml97 || self.state.language != Language::Inventor;
        let camera = self.options.camera.as_ref();
        let level = match camera.filter(|_| !self.options.finest_level) {
            Some(camera) => {
                let distance = if is_local {
                    let inverse = world_from_object.inverse();
                    inverse.transform_point3(camera.position).distance(center)
                } else {
                    let world = world_from_object.transform_point3(center);
                    camera.position.distance(world)
                };
                ranges
                    .iter()
                    .take_while(|&&range| distance >= f64::from(range))
                    .count()
            }
            None => 0,
        };
        self.pick(list, level.min(list.len().saturating_sub(1)));
    }

    /// Walks the child that a `LevelOfDetail` selects by the area of the box around its children in
    /// pixels. As in SGI's library `Complexity` 0 selects the coarsest level and 1 the finest. In
    /// between the area counts in proportion to it up to ½, and from there approaches the first
    /// limit.
    pub(super) fn level_of_detail(&mut self, node: NodeRef<'a>) {
        let list = Self::choices(node);
        if self.options.all_levels {
            self.stack.push(WalkFrame::List { list, next: 0 });
            return;
        }
        let last = list.len().saturating_sub(1);
        let complexity = self.state.complexity.value;
        let index = if complexity <= 0.0 {
            last
        } else if complexity >= 1.0 {
            0
        } else {
            match self.visitor.screen_area(node, &self.state) {
                Some(area) => {
                    let limits = node.get(level_of_detail::SCREEN_AREA);
                    let first = limits.first().map_or(area, |&limit| f64::from(limit));
                    let twice = 2.0 * f64::from(complexity);
                    let area = match twice <= 1.0 {
                        true => twice * area,
                        false => area + (twice - 1.0) * (first - area),
                    };
                    let level = limits.iter().position(|&limit| area >= f64::from(limit));
                    let none = if limits.is_empty() { 0 } else { last };
                    level.unwrap_or(none).min(last)
                }
                None => 0,
            }
        };
        self.pick(list, index);
    }

    /// Turns the +z axis of a `Billboard` to the camera, about an axis or freely.
    pub(super) fn turn_to_camera(&mut self, node: NodeRef<'a>) {
        let Some(camera) = &self.options.camera else {
            return;
        };
        let inverse = self.state.world_from_object.inverse();
        let eye = match camera.projection {
            Projection::Perspective { .. } => inverse.transform_point3(camera.position),
            Projection::Orthographic { .. } => inverse.transform_vector3(-camera.direction()),
        };
        let axis = node.get(billboard::AXIS_OF_ROTATION).as_dvec3();
        let turn = match axis.try_normalize() {
            Some(axis) => {
                let flat = (eye - axis * eye.dot(axis)).try_normalize();
                let front = (DVec3::Z - axis * axis.z).try_normalize();
                let (Some(flat), Some(front)) = (flat, front) else {
                    return;
                };
                let angle = libm::atan2(front.cross(flat).dot(axis), front.dot(flat));
                glam::DQuat::from_axis_angle(axis, angle)
            }
            None => {
                let up = inverse.transform_vector3(camera.orientation * DVec3::Y);
                let Some(z) = eye.try_normalize() else {
                    return;
                };
                let Some(x) = up.cross(z).try_normalize() else {
                    return;
                };
                glam::DQuat::from_mat3(&glam::DMat3::from_cols(x, z.cross(x), z))
            }
        };
        if turn.is_finite() {
            self.state.multiply(DMat4::from_quat(turn));
        }
    }
}
