//! Draws the section of a lens through its axis, with rays, as in figures 3 to 5 and 13 to 16 of
//! the paper.
//!
//! Light comes from the left. Each fan is the beam of one field. A lost ray ends in a
//! small cross at the surface where it is lost.

use glam::{DVec2, DVec3};

use crate::lens::{Lens, LensRay, Prescription, RayPath, SheetSetting, Surface, Toward};

use super::drawing::{Anchor, Drawing, DrawingItem, Ink};
use super::numbers::{round_number, tidy};

/// The options of a section.
#[derive(Clone, Debug)]
pub struct SectionOptions {
    /// The width of the drawing; the height follows from it.
    pub width: f64,
    /// The greatest height.
    pub height: f64,
    /// The z of the film. Default: the focus on the axis.
    pub film_z: Option<f64>,
    /// The distance of the object from the front vertex, in millimeters; it may be infinite.
    pub distance: f64,
    /// The film heights whose beams are drawn, in millimeters.
    pub fields: Vec<f64>,
    /// The number of rays of each beam that pass through the lens.
    pub rays: usize,
    /// Whether lost rays are drawn, to the point where they are lost.
    pub lost: bool,
    /// Whether principal planes and focal points are drawn.
    pub marks: bool,
}

impl SectionOptions {
    /// The options for a lens with the film and the object of a setting. Without an image only the
    /// beam on the axis is drawn.
    pub fn for_lens(lens: &Lens, setting: &SheetSetting<'_>) -> Self {
        let height = setting.full_height(lens).unwrap_or(0.0);
        let conjugate = setting.conjugate(lens);
        let film_z = conjugate.map_or(1.3 * lens.length(), |c| c.film_z);
        let mut options = Self {
            distance: conjugate.map_or(f64::INFINITY, |c| c.distance),
            ..Self::of(film_z, height)
        };
        if height == 0.0 {
            options.fields = vec![0.0];
        }
        options
    }

    /// Returns options with beams on the axis, at 7/10 of the film's height and at its edge.
    pub fn of(film_z: f64, film_height: f64) -> Self {
        Self {
            width: 960.0,
            height: 420.0,
            film_z: Some(film_z),
            distance: f64::INFINITY,
            fields: vec![0.0, 0.7 * film_height, film_height],
            rays: 7,
            lost: true,
            marks: true,
        }
    }
}

/// A lens section with rays, in lens space, to be drawn at any size.
#[derive(Clone, Debug)]
pub struct LensDiagram {
    /// Strokes in millimeters, z to the right and y up.
    strokes: Vec<SectionStroke>,
    signs: Vec<Sign>,
    /// The entries of the legend, with the style of their lines.
    legend: Vec<(String, Ink)>,
    options: SectionOptions,
}

/// A line or a filled outline.
#[derive(Clone, Debug)]
struct SectionStroke {
    points: Vec<DVec2>,
    closed: bool,
    ink: Ink,
    /// Whether it ends in a cross.
    ends_lost: bool,
}

/// A letter at a point, above or below it.
#[derive(Clone, Debug)]
struct Sign {
    at: DVec2,
    text: &'static str,
    above: bool,
    dot: bool,
}

impl LensDiagram {
    /// Draws a lens with the beams of the options.
    pub fn of(lens: &Lens, options: SectionOptions) -> Self {
        let mut this = Self {
            strokes: Vec::new(),
            signs: Vec::new(),
            legend: Vec::new(),
            options,
        };
        let film_z = this.film_z(lens);
        let reach = reach(lens.prescription());
        this.axis(lens, film_z, reach);
        this.elements(lens, film_z, reach);
        for (i, height) in this.options.fields.clone().into_iter().enumerate().rev() {
            this.fan(lens, i as u8, height, film_z, reach);
        }
        this.stop(lens, reach);
        this.mirrors(lens, reach);
        let top = this
            .options
            .fields
            .iter()
            .fold(0.0, |a: f64, b| a.max(b.abs()));
        let half = if top > 0.0 { top } else { 0.3 * reach };
        let film = [-half, half].map(|y| behind(lens, DVec3::new(0.0, y, film_z)));
        this.stroke(film.to_vec(), Ink::Film);
        if this.options.marks && !lens.prescription().is_decentered() {
            this.marks(lens, film_z, reach);
        }
        this
    }

    /// Adds the path of a ray, given in lens space as (z, height). A lost ray ends in a cross.
    pub fn add_path(&mut self, points: Vec<DVec2>, ink: Ink, lost: bool) {
        self.strokes.push(SectionStroke {
            points,
            closed: false,
            ink,
            ends_lost: lost,
        });
    }

    /// Adds an entry to the legend at the lower right.
    pub fn add_legend(&mut self, name: String, ink: Ink) {
        self.legend.push((name, ink));
    }

    /// Returns the z of the film: the option's, or the focus, or a place behind the lens.
    fn film_z(&self, lens: &Lens) -> f64 {
        let focus = lens.first_order().focal.map(|f| f.rear_focal_point);
        let film = self.options.film_z.or(focus).filter(|z| z.is_finite());
        film.unwrap_or(1.2 * lens.length())
    }

    fn stroke(&mut self, points: Vec<DVec2>, ink: Ink) {
        self.strokes.push(SectionStroke {
            points,
            closed: false,
            ink,
            ends_lost: false,
        });
    }

    fn axis(&mut self, lens: &Lens, film_z: f64, reach: f64) {
        let span = extent(lens, film_z);
        if lens.prescription().is_decentered() {
            let count = lens.prescription().surfaces.len();
            let vertices = (0..count).map(|i| flat(lens.placed(i, DVec3::ZERO)));
            let mut points = vec![DVec2::new(-0.18 * span - 0.2 * reach, 0.0)];
            points.extend(vertices);
            points.push(behind(lens, film_z * DVec3::Z));
            self.stroke(points, Ink::Axis);
            return;
        }
        let (from, to) = (-0.18 * span - 0.2 * reach, span + 0.05 * span);
        self.stroke(vec![DVec2::new(from, 0.0), DVec2::new(to, 0.0)], Ink::Axis);
    }

    /// Draws every gap that is not air, up to the next surface that refracts.
    fn elements(&mut self, lens: &Lens, film_z: f64, reach: f64) {
        let layout = SectionLayout::of(lens);
        let folded = &layout.folded;
        let surfaces = &folded.surfaces;
        let idle = |i: usize| surfaces[i].is_idle(folded.medium_before(i));
        for i in 0..surfaces.len() {
            let n = surfaces[i].medium.n_d;
            // Light behind a mirror goes through the glass in front of it.
            if n < 1.05 || idle(i) || surfaces[i].is_mirror {
                continue;
            }
            let next = (i + 1..surfaces.len()).find(|j| !idle(*j));
            let front = layout.profile(i, reach);
            let rear = match next {
                Some(j) => layout.profile(j, reach),
                None => {
                    let a = radius(&surfaces[i], reach);
                    [-a, a]
                        .map(|y| behind(lens, DVec3::new(0.0, y, film_z)))
                        .to_vec()
                }
            };
            let dense = match surfaces[i].medium.abbe() {
                Some(v) if v < 32.0 => 3,
                Some(v) if v < 45.0 => 2,
                Some(v) if v < 58.0 => 1,
                Some(_) => 0,
                None => ((n - 1.45) / 0.12).clamp(0.0, 3.0) as u8,
            };
            let points = match lens.prescription().is_decentered() {
                true => front.into_iter().chain(rear.into_iter().rev()).collect(),
                false => element(front, rear),
            };
            self.strokes.push(SectionStroke {
                points,
                closed: true,
                ink: Ink::Glass(dense),
                ends_lost: false,
            });
        }
    }

    /// Draws mirrors, and what closes the middles of other surfaces.
    fn mirrors(&mut self, lens: &Lens, reach: f64) {
        let layout = SectionLayout::of(lens);
        for (i, surface) in layout.folded.surfaces.iter().enumerate() {
            let (closed, a) = (surface.obstruction, radius(surface, reach));
            let sides = match (surface.is_mirror, closed > 0.0) {
                (true, true) => vec![[-a, -closed], [closed, a]],
                (true, false) => vec![[-a, a]],
                (false, true) => vec![[-closed, closed]],
                (false, false) => continue,
            };
            for [from, to] in sides {
                let points = (0..=48).map(|i| from + (to - from) * f64::from(i) / 48.0);
                let points = points.map(|y| layout.point(i, surface.sag(y), y));
                self.stroke(points.collect(), Ink::Stop);
            }
        }
    }

    /// Draws the blades of the stop.
    fn stop(&mut self, lens: &Lens, reach: f64) {
        let Some(stop) = lens.prescription().stop() else {
            return;
        };
        let layout = SectionLayout::of(lens);
        let surface = &layout.folded.surfaces[stop];
        let a = radius(surface, reach);
        let sag = surface.sag(a);
        for sign in [1.0, -1.0] {
            let ends = [a, a + 0.13 * reach].map(|y| layout.point(stop, sag, sign * y));
            self.stroke(ends.to_vec(), Ink::Stop);
        }
    }

    /// Draws the beam whose chief ray arrives at −`height` on the film.
    fn fan(&mut self, lens: &Lens, number: u8, height: f64, film_z: f64, reach: f64) {
        let Some((start, d)) = beam(lens, height, film_z) else {
            return;
        };
        let across = DVec3::new(0.0, d.z, -d.y);
        let lead = 0.16 * extent(lens, film_z) + 0.25 * reach;
        let distance = self.options.distance;
        let source =
            (distance.is_finite() && d.z > 0.0).then(|| start - (distance + start.z) / d.z * d);
        let trace = |s: f64| {
            let origin = start + s * across;
            let ray = match source {
                Some(source) => LensRay::new(source, (origin - source).normalize()),
                None => LensRay::new(origin - 4.0 * reach * d, d),
            };
            (
                origin,
                ray.direction,
                lens.trace_path(&ray, Toward::Film, true),
            )
        };
        let widest = 2.2 * reach;
        let steps = 1200;
        let at = |i: i32| f64::from(i) / f64::from(steps) * widest;
        let mut passing = (-steps..=steps).filter(|i| trace(at(*i)).2.outcome.is_ok());
        let Some(first) = passing.next() else { return };
        let last = passing.next_back().unwrap_or(first);
        let (low, high) = (at(first), at(last));
        let count = self.options.rays.max(2);
        let mut offsets: Vec<f64> = (0..count)
            .map(|i| low + (high - low) * i as f64 / (count - 1) as f64)
            .collect();
        if self.options.lost {
            let beside = 0.5 * (high - low) / (count - 1) as f64 + widest / f64::from(steps);
            for k in 1..=3 {
                offsets.push(low - f64::from(2 * k - 1) * beside);
                offsets.push(high + f64::from(2 * k - 1) * beside);
            }
        }
        for s in offsets {
            let (origin, d, path) = trace(s);
            // A ray starts at its object, if that is on the drawing.
            let lead = lead.min(source.map_or(lead, |s| (origin - s).length()));
            self.ray(lens, number, (origin - lead * d, d), &path, film_z);
        }
    }

    /// Draws one ray of a fan, from a point in front of the lens in its direction there.
    fn ray(
        &mut self,
        lens: &Lens,
        number: u8,
        (begin, d): (DVec3, DVec3),
        path: &RayPath,
        film_z: f64,
    ) {
        let mut points: Vec<DVec2> = path.hits.iter().map(|p| flat(*p)).collect();
        let Some(first) = path.hits.first() else {
            return;
        };
        // A steep ray may meet the front surface behind the wavefront where drawing starts.
        let begin = if (*first - begin).dot(d) > 0.0 {
            begin
        } else {
            *first - 0.05 * d
        };
        points.insert(0, flat(begin));
        match path.outcome {
            Ok(out) => {
                if out.direction.z > 1e-6 {
                    points.push(behind(lens, out.at_z(film_z)));
                }
                self.stroke(points, Ink::Ray(number));
            }
            Err(loss) if loss.surface > 0 => self.strokes.push(SectionStroke {
                points,
                closed: false,
                ink: Ink::Lost(number),
                ends_lost: true,
            }),
            Err(_) => {}
        }
    }

    /// Draws H, H′, F and F′ if they are on the drawing or near it.
    fn marks(&mut self, lens: &Lens, film_z: f64, reach: f64) {
        let Some(focal) = lens.first_order().focal else {
            return;
        };
        let span = extent(lens, film_z);
        let near = |z: f64| (-0.3 * span..1.35 * span).contains(&z);
        let half = 1.1 * reach;
        let planes = [
            (focal.front_principal_plane, "H", true),
            (focal.rear_principal_plane, "H\u{2032}", false),
        ];
        for (z, text, above) in planes {
            if near(z) {
                self.stroke(vec![DVec2::new(z, -half), DVec2::new(z, half)], Ink::Plane);
                let y = if above { half } else { -half };
                self.signs.push(Sign {
                    at: DVec2::new(z, y),
                    text,
                    above,
                    dot: false,
                });
            }
        }
        let points = [
            (focal.front_focal_point, "F", false),
            (focal.rear_focal_point, "F\u{2032}", true),
        ];
        for (z, text, above) in points {
            if near(z) {
                self.signs.push(Sign {
                    at: DVec2::new(z, 0.0),
                    text,
                    above,
                    dot: true,
                });
            }
        }
    }

    /// Returns the drawing, with a scale in millimeters.
    pub fn drawing(&self) -> Drawing {
        let all = self.strokes.iter().flat_map(|s| s.points.iter());
        let all = all.chain(self.signs.iter().map(|s| &s.at));
        let (low, high) = all.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(*p), high.max(*p))
        });
        let size = (high - low).max(DVec2::splat(1e-9));
        let (margin, foot) = (16.0, 26.0);
        let room = DVec2::new(
            self.options.width - 2.0 * margin,
            self.options.height - 2.0 * margin - foot,
        );
        let scale = (room.x / size.x).min(room.y / size.y);
        let height = size.y * scale + 2.0 * margin + foot;
        let left = margin + 0.5 * (room.x - size.x * scale);
        let place = |p: &DVec2| {
            [
                left + (p.x - low.x) * scale,
                margin + (high.y - p.y) * scale,
            ]
        };
        let mut drawing = Drawing::new(self.options.width, height);
        for stroke in &self.strokes {
            let points: Vec<[f64; 2]> = stroke.points.iter().map(place).collect();
            let end = points.last().copied();
            if stroke.closed {
                drawing.shape(points, stroke.ink);
            } else {
                drawing.path(points, stroke.ink);
            }
            if let (true, Some(at)) = (stroke.ends_lost, end) {
                drawing.items.push(DrawingItem::Cross {
                    at,
                    size: 2.2,
                    ink: stroke.ink,
                });
            }
        }
        for sign in &self.signs {
            let [x, y] = place(&sign.at);
            if sign.dot {
                drawing.items.push(DrawingItem::Dot {
                    at: [x, y],
                    radius: 2.0,
                    ink: Ink::Mark,
                });
            }
            let gap = if sign.above { -6.0 } else { 15.0 };
            let x = if sign.dot { x + 3.5 } else { x };
            let anchor = if sign.dot {
                Anchor::Start
            } else {
                Anchor::Middle
            };
            drawing.symbol([x, y + gap], anchor, 13.0, sign.text);
        }
        scale_bar(&mut drawing, scale, size.x, margin, height);
        let mut x = self.options.width - margin;
        for (name, ink) in self.legend.iter().rev() {
            let y = height - margin + 4.0;
            let length = 5.6 * name.chars().count() as f64;
            drawing.text([x, y + 3.5], Anchor::End, 10.5, name.as_str());
            drawing.line([x - length - 24.0, y], [x - length - 6.0, y], *ink);
            x -= length + 40.0;
        }
        drawing
    }
}

fn scale_bar(drawing: &mut Drawing, scale: f64, width: f64, margin: f64, height: f64) {
    let length = round_number(width / 9.0);
    let (x, y) = (margin + 2.0, height - margin + 4.0);
    let end = x + length * scale;
    drawing.line([x, y], [end, y], Ink::Label);
    for x in [x, end] {
        drawing.line([x, y - 3.0], [x, y + 3.0], Ink::Label);
    }
    let text = format!("{} mm", tidy(length, length));
    drawing.text([end + 7.0, y + 3.5], Anchor::Start, 10.5, text);
}

/// Returns the start on the front surface and the direction of the beam of a film height, or `None`
/// if it has no chief ray.
fn beam(lens: &Lens, height: f64, film_z: f64) -> Option<(DVec3, DVec3)> {
    if height == 0.0 {
        return Some((DVec3::ZERO, DVec3::Z));
    }
    let chief = lens.chief_ray(DVec2::new(0.0, -height), film_z)?;
    Some((chief.origin, -chief.direction))
}

/// The point of the drawing of a point of lens space: z and y.
fn flat(p: DVec3) -> DVec2 {
    DVec2::new(p.z, p.y)
}

/// The point of the drawing of a point behind the lens.
fn behind(lens: &Lens, p: DVec3) -> DVec2 {
    flat(lens.in_lens_space(p))
}

/// Where the surfaces of a lens are on the drawing.
struct SectionLayout<'a> {
    lens: &'a Lens,
    /// The surfaces with the signs of the straight axis.
    folded: Prescription,
    /// The z of their vertices on it.
    vertices: Vec<f64>,
}

impl<'a> SectionLayout<'a> {
    fn of(lens: &'a Lens) -> Self {
        let folded = lens.prescription().folded();
        let vertices = vertices(&folded.surfaces);
        Self {
            lens,
            folded,
            vertices,
        }
    }

    /// The point of a surface at a height, with its sag there.
    fn point(&self, i: usize, sag: f64, y: f64) -> DVec2 {
        if !self.folded.is_decentered() {
            return DVec2::new(self.vertices[i] + sag, y);
        }
        let along = self.lens.prescription().surfaces[i].sag(y);
        flat(self.lens.placed(i, DVec3::new(0.0, y, along)))
    }

    /// The points of a surface from its lower rim to its upper one.
    fn profile(&self, i: usize, reach: f64) -> Vec<DVec2> {
        let points = profile(&self.folded.surfaces[i], reach);
        points.map(|p| self.point(i, p.x, p.y)).collect()
    }
}

/// The z of the vertices of surfaces whose thicknesses have the signs of the straight axis.
fn vertices(surfaces: &[Surface]) -> Vec<f64> {
    let next = |z: &mut f64, s: &Surface| Some(std::mem::replace(z, *z + s.thickness));
    surfaces.iter().scan(0.0, next).collect()
}

/// The greatest z of the film and of the surfaces.
fn extent(lens: &Lens, film_z: f64) -> f64 {
    let vertices = match lens.prescription().has_mirrors() {
        true => vertices(&lens.prescription().folded().surfaces),
        false => vec![lens.length()],
    };
    vertices.into_iter().fold(lens.straight_z(film_z), f64::max)
}

/// Returns the largest finite semi-diameter, or 1.
fn reach(lens: &Prescription) -> f64 {
    let reach = lens.widest_semi_diameter();
    if reach > 0.0 { reach } else { 1.0 }
}

fn radius(surface: &Surface, reach: f64) -> f64 {
    surface.semi_diameter.min(reach)
}

/// Returns points of a surface relative to its vertex, from its lower rim to its upper one.
fn profile(surface: &Surface, reach: f64) -> impl Iterator<Item = DVec2> {
    let a = radius(surface, reach);
    let steps = if surface.is_plane() { 1 } else { 48 };
    (0..=steps).map(move |i| {
        // The points are denser toward the rim, where a strong curve is steep.
        let t = 2.0 * f64::from(i) / f64::from(steps) - 1.0;
        let y = a * libm::sin(0.5 * std::f64::consts::PI * t);
        DVec2::new(surface.sag(y), y)
    })
}

/// Returns the outline of an element. The narrower side is extended flat to the wider one's rim, if
/// there is glass between them.
fn element(mut front: Vec<DVec2>, mut rear: Vec<DVec2>) -> Vec<DVec2> {
    let rim = |side: &[DVec2]| side[side.len() - 1];
    let (f, r) = (rim(&front), rim(&rear));
    let wide = f.y.max(r.y);
    if f.x < r.x {
        for (side, rim) in [(&mut front, f), (&mut rear, r)] {
            if rim.y < wide {
                side.insert(0, DVec2::new(rim.x, -wide));
                side.push(DVec2::new(rim.x, wide));
            }
        }
    }
    rear.reverse();
    front.extend(rear);
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(name: &str) -> (Lens, LensDiagram) {
        let lens = Lens::named(name).unwrap();
        let film = lens.first_order().focal.unwrap().rear_focal_point;
        let diagram = LensDiagram::of(
            &lens,
            SectionOptions::of(film, 0.3 * lens.first_order().efl()),
        );
        (lens, diagram)
    }

    #[test]
    fn a_section_has_every_element_and_the_film_where_the_rays_end() {
        let (lens, diagram) = section("double-gauss");
        let glasses = diagram
            .strokes
            .iter()
            .filter(|s| matches!(s.ink, Ink::Glass(_)));
        assert_eq!(glasses.count(), 6);
        let film = lens.first_order().focal.unwrap().rear_focal_point;
        let rays = diagram
            .strokes
            .iter()
            .filter(|s| matches!(s.ink, Ink::Ray(_)));
        for ray in rays {
            assert!((ray.points.last().unwrap().x - film).abs() < 1e-9);
        }
        let on_axis = diagram
            .strokes
            .iter()
            .filter(|s| s.ink == Ink::Ray(0))
            .count();
        assert_eq!(on_axis, 7);
    }

    #[test]
    fn a_lost_ray_ends_inside_the_lens() {
        let (lens, diagram) = section("double-gauss");
        let lost: Vec<_> = diagram.strokes.iter().filter(|s| s.ends_lost).collect();
        assert!(!lost.is_empty());
        for ray in lost {
            let end = ray.points.last().unwrap();
            assert!((-1.0..=lens.length() + 1.0).contains(&end.x), "{end}");
        }
    }

    #[test]
    fn every_shipped_lens_is_drawn_in_finite_strokes() {
        for name in crate::lens::shipped_names() {
            let drawing = section(name).1.drawing();
            let text = drawing.to_svg();
            assert!(
                text.len() > 3000 && !text.contains("NaN") && !text.contains("inf"),
                "{name}"
            );
            assert!(drawing.height <= 420.5, "{name}");
            assert!(drawing.to_fig().starts_with("#FIG 3.2\n"));
        }
    }
}
