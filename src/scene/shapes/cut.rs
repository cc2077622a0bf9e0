//! Triangles of vertex shapes: cut first, dressed afterwards.
//!
//! A shape's function says where each triangle's corners stand in the shape; points, normals,
//! materials and texture coordinates are then looked up for many triangles at once, one list after
//! the other, and each point and normal is moved into the scene once, however many corners it has.

use glam::Vec3;

use super::runs::Runs;
use super::vertices::{By, Normals, Place, Vertices, wrapped};
use crate::geometry::normals::face_normal;
use crate::scene::builder::Builder;
use crate::traversal::state::{Binding, TextureCoordinates};

/// A triangle by the places of its corners.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Positions in the shape's index, or numbers of its corners where it has none.
    pub corners: [u32; 3],
    /// What goes by face or by part goes by these for all three corners.
    pub face: u32,
    pub part: u32,
}

/// Lists that shapes fill one after the other, kept to spare their making.
#[derive(Default)]
pub struct Scratch {
    points: Vec<Vec3>,
    cuts: Vec<Cut>,
    /// Points that a triangle has, where only boxes are asked for.
    met: Vec<bool>,
}

/// So many triangles are dressed at once: their places fit in the nearest cache.
const AT_ONCE: usize = 512;

/// A list with far more entries than a shape has corners is read corner by corner.
const FAR_MORE: usize = 2;

/// Takes a shape's triangles.
pub struct Cutter<'a, 's, 'v, 'b> {
    runs: &'v Runs<'v>,
    vertices: &'v Vertices<'a, 's>,
    out: &'b mut Builder<'a>,
    points: Points<'v>,
    normal_numbers: Numbers<'v>,
    /// Where normal 0 would be among the surface's, and the last, which stands for those that
    /// are missing.
    first_normal: u32,
    last_normal: u32,
    material_numbers: Numbers<'v>,
    texture_numbers: Numbers<'v>,
    scratch: Scratch,
}

/// Which entry of the moved points each position has.
struct Points<'v> {
    index: Option<&'v [i32]>,
    /// The coordinate that is first among the moved.
    first: u32,
    /// Some corner has no coordinate.
    missing: bool,
    /// Some point cannot be drawn.
    unsound: bool,
}

impl Points<'_> {
    #[inline(always)]
    fn number(&self, position: u32) -> usize {
        match self.index {
            Some(index) => (index[position as usize] as u32 - self.first) as usize,
            None => position as usize,
        }
    }
}

/// Which entry of a list a corner has.
enum Numbers<'v> {
    Same,
    Position,
    Listed(&'v [i32]),
    /// By the corners before each position.
    Counted(Vec<u32>),
    Face,
    FaceListed(&'v [i32]),
    Part,
    PartListed(&'v [i32]),
}

/// An entry of an index; where it has none, the first.
#[inline(always)]
fn listed(list: &[i32], at: u32) -> u32 {
    let entry = list.get(at as usize).copied().unwrap_or(0);
    entry.max(0) as u32
}

/// What three corners have each.
#[inline(always)]
fn three<T>([a, b, c]: [u32; 3], entry: impl Fn(u32) -> T) -> [T; 3] {
    [entry(a), entry(b), entry(c)]
}

impl Numbers<'_> {
    /// Appends what each triangle's three corners have.
    #[inline(always)]
    fn each<T: Copy>(&self, cuts: &[Cut], list: &mut Vec<[T; 3]>, entry: impl Fn(u32) -> T) {
        match self {
            Self::Same => list.extend(cuts.iter().map(|_| [entry(0); 3])),
            Self::Position => list.extend(cuts.iter().map(|c| three(c.corners, &entry))),
            Self::Listed(index) => {
                let entry = |position: u32| entry(listed(index, position));
                list.extend(cuts.iter().map(|c| three(c.corners, entry)));
            }
            Self::Counted(counts) => {
                let entry = |position: u32| entry(counts[position as usize]);
                list.extend(cuts.iter().map(|c| three(c.corners, entry)));
            }
            Self::Face => list.extend(cuts.iter().map(|c| [entry(c.face); 3])),
            Self::FaceListed(index) => {
                list.extend(cuts.iter().map(|c| [entry(listed(index, c.face)); 3]));
            }
            Self::Part => list.extend(cuts.iter().map(|c| [entry(c.part); 3])),
            Self::PartListed(index) => {
                list.extend(cuts.iter().map(|c| [entry(listed(index, c.part)); 3]));
            }
        }
    }
}

impl<'v> Numbers<'v> {
    fn of(
        binding: Binding,
        index: Option<&'v [i32]>,
        coord: Option<&'v [i32]>,
        runs: &Runs<'_>,
    ) -> Self {
        match (binding, index) {
            (Binding::Overall, _) => Self::Same,
            (Binding::PerVertex, _) => Self::counted(runs),
            (Binding::PerVertexIndexed, _) => match index.or(coord) {
                Some(index) => Self::Listed(index),
                None => Self::counted(runs),
            },
            (Binding::PerFaceIndexed, Some(index)) => Self::FaceListed(index),
            (Binding::PerFace | Binding::PerFaceIndexed, _) => Self::Face,
            (Binding::PerPartIndexed, Some(index)) => Self::PartListed(index),
            (Binding::PerPart | Binding::PerPartIndexed, _) => Self::Part,
        }
    }

    /// Corners before each position: the position itself where nothing but corners is there.
    fn counted(runs: &Runs<'_>) -> Self {
        let corners: usize = runs.runs.iter().map(|r| r.len()).sum();
        if corners == runs.positions() {
            return Self::Position;
        }
        Self::Counted(counts(runs))
    }
}

fn counts(runs: &Runs<'_>) -> Vec<u32> {
    let mut counts = vec![0; runs.positions()];
    let mut count = 0;
    for run in &runs.runs {
        for place in &mut counts[run.0.clone()] {
            *place = count;
            count += 1;
        }
    }
    counts
}

impl<'a, 's, 'v, 'b> Cutter<'a, 's, 'v, 'b> {
    /// For a shape of so many triangles at most.
    pub fn new(
        runs: &'v Runs<'v>,
        vertices: &'v Vertices<'a, 's>,
        triangles: usize,
        out: &'b mut Builder<'a>,
    ) -> Self {
        let mut scratch = std::mem::take(out.scratch());
        let points = points(runs, vertices, out, &mut scratch.points);
        if out.is_surveying() {
            scratch.met.clear();
            scratch.met.resize(scratch.points.len(), false);
        }
        let coord = vertices.coord_index;
        let mut normal_numbers = Numbers::Same;
        let (mut first_normal, mut last_normal) = (0, 0);
        if out.keeps_normals() {
            let turned = normals(runs, vertices, out);
            normal_numbers = turned.numbers;
            last_normal = turned.last;
            // Numbers begin at the lowest that is used.
            first_normal = out.keep_normals(turned.list).wrapping_sub(turned.lowest);
        }
        let indexed = vertices.state.texture_indexed && coord.is_some();
        let texture_binding = if indexed {
            Binding::PerVertexIndexed
        } else {
            Binding::PerVertex
        };
        let texture_numbers = match vertices.boxed {
            Some(_) => Numbers::of(texture_binding, vertices.texture_index, coord, runs),
            None => Numbers::Same,
        };
        out.expect(triangles);
        Self {
            runs,
            vertices,
            points,
            normal_numbers,
            first_normal,
            last_normal,
            material_numbers: if out.keeps_materials() {
                Numbers::of(
                    vertices.material_binding,
                    vertices.material_index,
                    coord,
                    runs,
                )
            } else {
                Numbers::Same
            },
            texture_numbers,
            scratch,
            out,
        }
    }

    #[inline]
    pub fn cut(&mut self, corners: [usize; 3], face: usize, part: usize) {
        self.scratch.cuts.push(Cut {
            corners: corners.map(|c| c as u32),
            face: face as u32,
            part: part as u32,
        });
        if self.scratch.cuts.len() == AT_ONCE {
            self.dress();
        }
    }

    /// Ends the shape.
    pub fn finish(mut self) {
        self.dress();
        if self.out.is_surveying() {
            let points = self.scratch.points.iter().zip(&self.scratch.met);
            let met = points.filter(|(_, met)| **met).map(|(point, _)| *point);
            self.out.bound_all(met);
        }
        *self.out.scratch() = self.scratch;
    }

    fn dress(&mut self) {
        let mut cuts = std::mem::take(&mut self.scratch.cuts);
        if self.points.missing {
            let known = self.vertices.coordinates.len();
            cuts.retain(|c| {
                c.corners
                    .iter()
                    .all(|&p| self.runs.coordinate(p as usize) < known)
            });
        }
        self.out.triangle_count += cuts.len() as u64;
        if self.out.outlines() {
            self.outline(&cuts);
        } else {
            if self.points.unsound {
                self.leave_out_unsound(&mut cuts);
            }
            if self.out.is_surveying() {
                self.meet(&cuts);
            } else {
                self.keep(&cuts);
            }
        }
        cuts.clear();
        self.scratch.cuts = cuts;
    }

    fn leave_out_unsound(&mut self, cuts: &mut Vec<Cut>) {
        let before = cuts.len();
        let sound = |&p: &u32| {
            let moved = self.scratch.points[self.points.number(p)];
            self.out.is_drawable(moved)
        };
        cuts.retain(|c| c.corners.iter().all(sound));
        self.out.census_mut().bad_corners += (before - cuts.len()) as u64;
    }

    fn meet(&mut self, cuts: &[Cut]) {
        for position in cuts.iter().flat_map(|c| c.corners) {
            self.scratch.met[self.points.number(position)] = true;
        }
    }

    fn outline(&mut self, cuts: &[Cut]) {
        let counts = counts(self.runs);
        for cut in cuts {
            let corners = cut.corners.map(|p| {
                self.vertices.corner(Place {
                    coordinate: self.runs.coordinate(p as usize),
                    position: p as usize,
                    count: counts[p as usize] as usize,
                    face: cut.face as usize,
                    part: cut.part as usize,
                })
            });
            if let [Some(a), Some(b), Some(c)] = corners {
                self.out.outline(&[a, b, c]);
            }
        }
    }

    fn keep(&mut self, cuts: &[Cut]) {
        let room = self.out.room(cuts.len());
        let cuts = &cuts[..room];
        let (points, all) = (&self.points, &*self.scratch.points);
        let lists = self.out.lists();
        match points.index {
            Some(index) => {
                let first = points.first;
                let at = |p: u32| all[(index[p as usize] as u32 - first) as usize];
                let triangles = cuts.iter().map(|c| three(c.corners, at));
                lists.triangles.extend(triangles);
            }
            None => {
                let triangles = cuts.iter().map(|c| three(c.corners, |p| all[p as usize]));
                lists.triangles.extend(triangles);
            }
        }
        if let Some(normals) = lists.normals {
            let (first, last) = (self.first_normal, self.last_normal);
            let number = |number: u32| first.wrapping_add(number.min(last));
            self.normal_numbers.each(cuts, normals.corners(), number);
        }
        if let Some(materials) = lists.materials {
            self.material_numbers.each(cuts, materials, |number| number);
        }
        let Some(coordinates) = lists.coordinates else {
            return;
        };
        let numbers = &self.texture_numbers;
        let thirds = lists.thirds;
        match (
            self.vertices.state.texture_coordinates,
            &self.vertices.boxed,
        ) {
            (TextureCoordinates::Two(list), _) => {
                let at = |number: u32| list.get(number as usize).copied().unwrap_or_default();
                numbers.each(cuts, coordinates, at);
                if let Some(thirds) = thirds {
                    Numbers::Same.each(cuts, thirds, |_| 0.0);
                }
            }
            (TextureCoordinates::Three(list), _) => {
                let at = |number: u32| list.get(number as usize).copied().unwrap_or_default();
                numbers.each(cuts, coordinates, |number| at(number).truncate());
                if let Some(thirds) = thirds {
                    numbers.each(cuts, thirds, |number| at(number).z);
                }
            }
            (TextureCoordinates::Wrapped(as_what), Some(boxed)) => {
                let (runs, known) = (self.runs, self.vertices.coordinates);
                let point = |position: u32| {
                    let point = known.get(runs.coordinate(position as usize));
                    point.unwrap_or_default()
                };
                coordinates.extend(cuts.iter().map(|cut| {
                    let corners = cut.corners.map(point);
                    let normal = face_normal(&corners, true);
                    corners.map(|p| wrapped(boxed, as_what, p, normal))
                }));
                if let Some(thirds) = thirds {
                    Numbers::Same.each(cuts, thirds, |_| 0.0);
                }
            }
            (_, Some(boxed)) => {
                let (runs, known) = (self.runs, self.vertices.coordinates);
                let at = |position: u32| {
                    let point = known.get(runs.coordinate(position as usize));
                    boxed.at(point.unwrap_or_default())
                };
                Numbers::Position.each(cuts, coordinates, |position| at(position).truncate());
                if let Some(thirds) = thirds {
                    Numbers::Position.each(cuts, thirds, |position| at(position).z);
                }
            }
            (_, None) => {
                Numbers::Same.each(cuts, coordinates, |_| glam::Vec2::ZERO);
                if let Some(thirds) = thirds {
                    Numbers::Same.each(cuts, thirds, |_| 0.0);
                }
            }
        }
    }
}

/// Moves the points that a shape uses into the scene.
fn points<'v>(
    runs: &'v Runs<'v>,
    vertices: &Vertices<'_, '_>,
    out: &Builder<'_>,
    moved: &mut Vec<Vec3>,
) -> Points<'v> {
    let used = runs.used();
    let positions = runs.positions();
    let known = vertices.coordinates;
    let index = runs.index().filter(|_| used.len() <= FAR_MORE * positions);
    moved.clear();
    let unsound = if out.outlines() {
        false
    } else if index.is_some() || runs.index().is_none() {
        let points = used.clone().map(|c| known.get(c).unwrap_or_default());
        !out.move_points(points, moved)
    } else {
        // Separators have no coordinate.
        let all = (0..positions).map(|p| runs.coordinate(p));
        !out.move_points(all.map(|c| known.get(c).unwrap_or_default()), moved)
    };
    Points {
        index,
        first: used.start as u32,
        missing: runs.is_missing(),
        unsound,
    }
}

/// The normals that a shape uses, turned into the scene's.
struct Turned<'v> {
    list: Vec<Vec3>,
    numbers: Numbers<'v>,
    /// The number of the first, and the last that there is.
    lowest: u32,
    last: u32,
}

fn normals<'v>(runs: &Runs<'_>, vertices: &'v Vertices<'_, '_>, out: &Builder<'_>) -> Turned<'v> {
    let (list, numbers): (&[Vec3], _) = match &vertices.normals {
        Normals::None => (&[Vec3::Z], Numbers::Same),
        Normals::Zero => (&[Vec3::ZERO], Numbers::Same),
        Normals::Made(list, by) => {
            let numbers = match by {
                By::Position => Numbers::Position,
                By::Face => Numbers::Face,
                By::Part => Numbers::Part,
                By::All => Numbers::Same,
            };
            (list, numbers)
        }
        Normals::Given(list) => {
            let (binding, coord) = (vertices.normal_binding, vertices.coord_index);
            let numbers = Numbers::of(binding, vertices.normal_index, coord, runs);
            (list, numbers)
        }
    };
    let list = if list.is_empty() { &[Vec3::Z] } else { list };
    let (positions, last) = (runs.positions(), list.len() - 1);
    let used = match numbers {
        Numbers::Listed(index) => {
            let all = runs.runs.iter().flat_map(|run| run.0.clone());
            let all = all.map(|p| (listed(index, p as u32) as usize).min(last));
            let (lowest, highest) = all.fold((last, 0), |(l, h), n| (l.min(n), h.max(n)));
            lowest.min(highest)..highest + 1
        }
        Numbers::FaceListed(_) | Numbers::PartListed(_) => 0..last + 1,
        // No others reach beyond the number of corners.
        _ => 0..(last + 1).min(positions.max(1)),
    };
    let mut turned = Vec::new();
    if let Numbers::Listed(index) = numbers
        && used.len() > FAR_MORE * positions
    {
        let at = |p: u32| list[(listed(index, p) as usize).min(last)];
        out.turn_normals((0..positions as u32).map(at), &mut turned);
        return Turned {
            list: turned,
            numbers: Numbers::Position,
            lowest: 0,
            last: u32::MAX,
        };
    }
    out.turn_normals(list[used.clone()].iter().copied(), &mut turned);
    Turned {
        list: turned,
        numbers,
        lowest: used.start as u32,
        last: last as u32,
    }
}
