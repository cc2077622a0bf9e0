//! A lens as a table of surfaces, and the checks that every reader's table goes through.

use std::sync::Arc;

use glam::DVec2;
use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};

use crate::prescription::decenter::{Decenter, SurfaceFrame};
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::{Dispersion, Medium};
use crate::prescription::surface::{Shape, Surface};

/// A lens as its designer specifies it: the surfaces in the order in which light meets them, and
/// the media between them.
///
/// Behind each mirror, z is counted along the light, as if the mirror were a lens: thicknesses are
/// positive, and a surface whose center is farther along the light has a positive radius. Files
/// have the signs of the straight z axis; [`Prescription::folded`] converts between the two.
#[derive(Clone, Debug, PartialEq)]
pub struct Prescription {
    /// The name of the lens.
    pub name: String,
    /// The comments of the file, in order, such as the design, the patent and the book.
    pub notes: Vec<String>,
    /// The surfaces from front to rear, the stop included.
    pub surfaces: Vec<Surface>,
    /// The medium in front of the first surface.
    pub object_medium: Medium,
    /// Half of the diagonal of the film that it is made for, in millimeters, if the file states it.
    pub image_height: Option<f64>,
    /// Half of the field in degrees, if the file states it by numbers of its format.
    pub half_field: Option<f64>,
    /// The wavelengths that the file states, in nanometers, the primary one first.
    pub wavelengths_nm: Vec<f64>,
    /// The weights of these wavelengths; empty if the file states none. Only writers use them.
    pub wavelength_weights: Vec<f64>,
    /// The axial beam that the file states by numbers of its format, for writers: the apertures
    /// decide what is traced.
    pub stated_beam: Option<StatedBeam>,
    /// The positions of a zoom lens; empty for a lens of one focal length.
    pub zoom: Vec<ZoomPosition>,
    /// The surfaces that move for focusing; none if the whole lens moves.
    pub focus_group: Option<FocusGroup>,
    /// The shape of the hole in the stop.
    pub iris: Iris,
    /// The f-number that the file states, if that of paraxial rays through the apertures differs.
    pub stated_f_number: Option<StatedFNumber>,
}

/// The axial beam that a file states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StatedBeam {
    /// The diameter of the entrance pupil in millimeters.
    EntrancePupil(f64),
    /// The f-number of the image.
    FNumber(f64),
}

/// An f-number that a file states beside the apertures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedFNumber {
    /// The number in the file.
    pub value: f64,
    /// The place of the file's number.
    pub span: Span,
    /// The relative difference that contradicts it.
    pub tolerance: f64,
}

/// A tabulated setting of a zoom lens: the gaps and the stop that differ from those of the
/// surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZoomPosition {
    /// The name of the position.
    pub name: String,
    /// Numbers of surfaces, each with the thickness behind it in millimeters.
    pub gaps: Vec<(usize, f64)>,
    /// The semi-diameter of the stop in millimeters; none if it does not change.
    pub stop_semi_diameter: Option<f64>,
}

/// The surfaces that move along the axis for focusing, which changes the gaps around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FocusGroup {
    /// The number of the first surface that moves.
    pub first: usize,
    /// The number of the last surface that moves.
    pub last: usize,
}

/// The shape of the hole in the stop.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Iris {
    /// A circle.
    #[default]
    Round,
    /// A regular polygon whose corners are on the stop's circle.
    Blades {
        /// The number of corners.
        count: u32,
        /// The rotation in radians; 0 has a corner on +x.
        rotation: f64,
    },
    /// Any polygon.
    Outline {
        /// The corners in units of the stop's semi-diameter, counterclockwise.
        corners: Vec<[f64; 2]>,
        /// The rotation in radians.
        rotation: f64,
    },
}

impl Prescription {
    /// A lens in air of these surfaces.
    pub fn new(name: impl Into<String>, surfaces: Vec<Surface>) -> Self {
        Self {
            name: name.into(),
            notes: Vec::new(),
            surfaces,
            object_medium: Medium::air(),
            image_height: None,
            half_field: None,
            wavelengths_nm: Vec::new(),
            wavelength_weights: Vec::new(),
            stated_beam: None,
            zoom: Vec::new(),
            focus_group: None,
            iris: Iris::Round,
            stated_f_number: None,
        }
    }

    /// The index in front of every surface and, last, the one behind the lens.
    pub fn indices(&self, wavelength_nm: f64) -> Vec<f64> {
        std::iter::once(&self.object_medium)
            .chain(self.surfaces.iter().map(|s| &s.medium))
            .map(|m| m.index(wavelength_nm))
            .collect()
    }

    /// The surface marked as the stop.
    pub fn stop(&self) -> Option<usize> {
        self.surfaces.iter().position(|s| s.is_stop)
    }

    /// The medium in front of a surface.
    pub(crate) fn medium_before(&self, surface: usize) -> &Medium {
        match surface.checked_sub(1) {
            Some(before) => &self.surfaces[before].medium,
            None => &self.object_medium,
        }
    }

    /// The largest finite semi-diameter in millimeters; 0 if no surface has one.
    pub fn widest_semi_diameter(&self) -> f64 {
        let all = self.surfaces.iter().map(|s| s.semi_diameter);
        all.filter(|r| r.is_finite()).fold(0.0, f64::max)
    }

    /// Whether the lens is symmetric about its axis.
    pub fn is_rotational(&self) -> bool {
        let is_round =
            |s: &Surface| s.shape.is_rotational() && s.frame.is_none() && s.outline.is_none();
        self.iris == Iris::Round && self.surfaces.iter().all(is_round)
    }

    /// Whether the index of a medium depends on the wavelength.
    pub fn is_dispersive(&self) -> bool {
        self.surfaces.iter().any(|s| s.medium.is_dispersive()) || self.object_medium.is_dispersive()
    }

    /// Makes a wavelength in nanometers the primary one, before those that the file states.
    pub fn make_primary(&mut self, nm: f64) {
        let at = self.wavelengths_nm.iter().position(|known| *known == nm);
        for (list, new) in [
            (&mut self.wavelengths_nm, nm),
            (&mut self.wavelength_weights, 1.0),
        ] {
            let known = at.filter(|at| *at < list.len());
            let moved = known.map_or(new, |at| list.remove(at));
            list.insert(0, moved);
        }
        // Weights are those of all wavelengths, or none.
        if self.wavelength_weights.len() != self.wavelengths_nm.len() {
            self.wavelength_weights.clear();
        }
    }

    /// The place of the first surface in front of a glass whose index at a wavelength in nanometers
    /// is not to be relied on, and why.
    pub fn doubtful_index(&self, nm: f64) -> Option<(Span, String)> {
        let doubt = |s: &Surface| Some((s.span, s.medium.doubt_at(nm)?));
        self.surfaces.iter().find_map(doubt)
    }

    /// Whether the path or the transmittance depends on the wavelength.
    pub fn is_chromatic(&self) -> bool {
        let tints = |s: &Surface| s.coating == Coating::MagnesiumFluoride;
        self.is_dispersive() || self.surfaces.iter().any(tints)
    }

    /// The lens with every length multiplied by a factor, as by the paper's option `-z`. A nominal
    /// focal length that its file states is no longer that of its lengths.
    pub fn scaled(&self, factor: f64) -> Self {
        let scale = |z: &ZoomPosition| ZoomPosition {
            name: z.name.clone(),
            gaps: z.gaps.iter().map(|&(i, gap)| (i, gap * factor)).collect(),
            stop_semi_diameter: z.stop_semi_diameter.map(|r| r * factor),
        };
        let notes = self
            .notes
            .iter()
            .filter(|note| !note.starts_with("nominal: "));
        Self {
            notes: notes.cloned().collect(),
            surfaces: self.surfaces.iter().map(|s| s.scaled(factor)).collect(),
            image_height: self.image_height.map(|h| h * factor),
            zoom: self.zoom.iter().map(scale).collect(),
            stated_beam: self.stated_beam.map(|beam| match beam {
                StatedBeam::EntrancePupil(diameter) => StatedBeam::EntrancePupil(diameter * factor),
                StatedBeam::FNumber(_) => beam,
            }),
            ..self.clone()
        }
    }

    /// Whether a surface other than the stop has a clear aperture that is not round.
    pub fn has_outlines(&self) -> bool {
        self.surfaces.iter().any(|s| s.outline.is_some())
    }

    /// Makes the clear aperture of the stop the iris.
    fn outline_to_iris(&mut self) {
        let stop = self.surfaces.iter_mut().find(|s| s.is_stop);
        let Some(stop) = stop else { return };
        if let Some(corners) = stop.outline.take() {
            let radius = stop.semi_diameter;
            let corners = corners.iter().map(|corner| (*corner / radius).to_array());
            self.iris = Iris::Outline {
                corners: corners.collect(),
                rotation: 0.0,
            };
        }
    }

    /// Whether any surface reflects.
    pub fn has_mirrors(&self) -> bool {
        self.surfaces.iter().any(|s| s.is_mirror)
    }

    /// Whether light leaves the straight axis: at a mirror, or at a decentered surface.
    pub fn is_folded(&self) -> bool {
        self.has_mirrors() || self.is_decentered()
    }

    /// Whether any surface is decentered or tilted.
    pub fn is_decentered(&self) -> bool {
        self.surfaces.iter().any(|s| s.frame.is_some())
    }

    /// The signs of z in front of each surface and, last, behind the lens: −1 where light travels
    /// against the straight z axis, behind an odd number of mirrors.
    pub(crate) fn facings(&self) -> Vec<f64> {
        let mut sign = 1.0;
        let mut signs = vec![sign];
        for surface in &self.surfaces {
            sign = if surface.is_mirror { -sign } else { sign };
            signs.push(sign);
        }
        signs
    }

    /// The lens with the signs of the straight z axis behind its mirrors, as files have them: the
    /// thickness behind one mirror is negative, and a surface there has a positive radius if its
    /// center is on the right. Of a lens that has these signs, it is the lens with z along the
    /// light. Every mirror has the medium in front of it on both sides.
    pub fn folded(&self) -> Self {
        let signs = self.facings();
        let mut lens = self.clone();
        for (i, signs) in signs.windows(2).enumerate() {
            let before = lens.medium_before(i).clone();
            let surface = &mut lens.surfaces[i];
            if signs[0] < 0.0 {
                *surface = surface.reversed();
            }
            if surface.is_mirror {
                surface.medium = before;
            }
            if signs[1] < 0.0 {
                surface.thickness = -surface.thickness;
            }
            if let Some(frame) = &mut surface.frame {
                let turned = |d: &Decenter, sign| match sign < 0.0 {
                    true => d.turned_around(),
                    false => *d,
                };
                frame.before = turned(&frame.before, signs[0]);
                frame.after = turned(&frame.after, signs[1]);
            }
        }
        let gaps = lens.zoom.iter_mut().flat_map(|zoom| &mut zoom.gaps);
        for (_, gap) in gaps.filter(|(i, _)| signs.get(i + 1) == Some(&-1.0)) {
            *gap = -*gap;
        }
        lens
    }

    /// Makes shifts along the axis parts of the gaps, so that these are distances along the axis.
    /// Surfaces stay where they are relative to each other, and the first vertex is the origin. The
    /// signs must be those of z along the light.
    pub(crate) fn shifts_to_gaps(&mut self) {
        for i in 0..self.surfaces.len() {
            let Some(mut frame) = self.surfaces[i].frame.take() else {
                continue;
            };
            let in_front = std::mem::take(&mut frame.before.shift.z);
            let behind = frame.after.take_shift_along_axis();
            self.surfaces[i].frame = frame.boxed();
            if let Some(gap) = i.checked_sub(1) {
                self.lengthen_gap(gap, in_front);
            }
            // The film is behind the last surface: without a distance it is counted from there.
            if i + 1 < self.surfaces.len() || self.surfaces[i].thickness != 0.0 {
                self.lengthen_gap(i, behind);
            }
        }
    }

    /// Makes the gap behind a surface longer, in all zoom positions.
    fn lengthen_gap(&mut self, surface: usize, by: f64) {
        self.surfaces[surface].thickness += by;
        let gaps = self.zoom.iter_mut().flat_map(|zoom| &mut zoom.gaps);
        for (_, gap) in gaps.filter(|(i, _)| *i == surface) {
            *gap += by;
        }
    }

    /// The lens with front and rear exchanged. It has no zoom positions and no focusing group.
    pub fn reversed(&self) -> Self {
        let count = self.surfaces.len();
        let turned = |frame: &SurfaceFrame| SurfaceFrame {
            before: frame.after.inverse().turned_around(),
            after: frame.before.inverse().turned_around(),
        };
        let surfaces = (0..count).rev().map(|i| Surface {
            medium: self.medium_before(i).clone(),
            frame: self.surfaces[i].frame.as_ref().map(|f| Box::new(turned(f))),
            thickness: i
                .checked_sub(1)
                .map_or(0.0, |before| self.surfaces[before].thickness),
            // Seen along the light that leaves it, a mirror has the shape that it has along the
            // light that reaches it.
            ..match self.surfaces[i].is_mirror {
                true => self.surfaces[i].clone(),
                false => self.surfaces[i].reversed(),
            }
        });
        Self {
            surfaces: surfaces.collect(),
            object_medium: self
                .surfaces
                .last()
                .map_or_else(Medium::air, |s| s.medium.clone()),
            zoom: Vec::new(),
            focus_group: None,
            stated_beam: None,
            ..self.clone()
        }
    }

    /// The lens with this coating on every surface.
    pub fn with_coating(mut self, coating: Coating) -> Self {
        self.surfaces.iter_mut().for_each(|s| s.coating = coating);
        self
    }

    /// Whether the gaps and the stop of the surfaces are those of a zoom position.
    pub(crate) fn is_at(&self, zoom: &ZoomPosition) -> bool {
        let gap = |i: usize| self.surfaces.get(i).map(|surface| surface.thickness);
        let stop = self.stop().map(|stop| self.surfaces[stop].semi_diameter);
        zoom.gaps.iter().all(|(i, at)| gap(*i) == Some(*at))
            && (zoom.stop_semi_diameter.is_none() || zoom.stop_semi_diameter == stop)
    }

    /// The lens at one of its tabulated zoom positions, counted from 0. It keeps all positions.
    ///
    /// # Errors
    ///
    /// Returns an error if the lens does not have that position.
    pub fn at_zoom(&self, position: usize) -> Result<Self> {
        let Some(zoom) = self.zoom.get(position) else {
            let help = match self.zoom.len() {
                0 => "this lens does not zoom".to_owned(),
                n => format!("it has positions 0 to {}", n - 1),
            };
            return Err(Diagnostic::error(format!(
                "`{}` has no zoom position {position}",
                self.name
            ))
            .with_help(help));
        };
        let mut lens = self.clone();
        lens.stated_beam = None;
        for &(i, gap) in &zoom.gaps {
            let Some(surface) = lens.surfaces.get_mut(i) else {
                continue;
            };
            let stated = std::mem::replace(&mut surface.thickness, gap);
            for other in &mut lens.zoom {
                other.state_gap(i, stated);
            }
        }
        if let (Some(radius), Some(stop)) = (zoom.stop_semi_diameter, lens.stop()) {
            let stated = std::mem::replace(&mut lens.surfaces[stop].semi_diameter, radius);
            let stated = Some(stated).filter(|radius| radius.is_finite());
            for other in &mut lens.zoom {
                other.stop_semi_diameter = other.stop_semi_diameter.or(stated);
            }
        }
        Ok(lens)
    }
}

impl ZoomPosition {
    /// Gives the position the gap behind a surface, if it does not state one.
    fn state_gap(&mut self, surface: usize, gap: f64) {
        if self.gaps.iter().all(|(stated, _)| *stated != surface) {
            self.gaps.push((surface, gap));
        }
    }
}

impl Iris {
    /// The corners of the hole in a stop of this semi-diameter, counterclockwise; none for a round
    /// hole, and for fewer than three corners, which enclose no area.
    pub(crate) fn outline(&self, semi_diameter: f64) -> Option<Box<[DVec2]>> {
        let turned = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            DVec2::new(cos, sin)
        };
        match self {
            Self::Round => None,
            Self::Blades { count: 0..3, .. } => None,
            Self::Outline { corners, .. } if corners.len() < 3 => None,
            Self::Blades { count, rotation } => {
                let corner = |i| {
                    let share = f64::from(i) / f64::from(*count);
                    semi_diameter * turned(rotation + std::f64::consts::TAU * share)
                };
                Some((0..*count).map(corner).collect())
            }
            Self::Outline { corners, rotation } => {
                let turn = turned(*rotation);
                let place = |c: &[f64; 2]| semi_diameter * turn.rotate(DVec2::from_array(*c));
                Some(corners.iter().map(place).collect())
            }
        }
    }
}

/// A column of the table, for the place of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Column {
    Radius,
    Thickness,
    Index,
    SemiDiameter,
}

/// The largest number of surfaces of a lens. The largest lenses that are made have about 60.
pub(crate) const MAX_SURFACES: usize = 1000;

/// The largest number of corners of an outline. Its hull takes work by the third power of them.
const MAX_CORNERS: usize = 256;

/// Refuses a lens of too many surfaces. Readers ask this before they compute anything of the lens.
///
/// # Errors
///
/// Returns an error of the kind [`ErrorKind::Limit`](ivcam_base::diag::ErrorKind::Limit).
pub(crate) fn check_count(surfaces: usize, source: &Arc<Source>) -> Result<()> {
    if surfaces <= MAX_SURFACES {
        return Ok(());
    }
    let message = format!("the lens has {surfaces} surfaces, more than {MAX_SURFACES}");
    Err(Diagnostic::beyond_limit(message)
        .at(source, Span::at(0))
        .with_help("is this file a lens?"))
}

/// The number of gaps that no real lens has: neighbors that cross where light passes, and glasses
/// without thickness.
pub(crate) fn crossings(lens: &Prescription) -> usize {
    let surfaces = &lens.surfaces;
    let is_wrong = |&(i, j, gap): &(usize, usize, f64)| {
        let (front, rear) = (&surfaces[i], &surfaces[j]);
        let reach = front.semi_diameter.min(rear.semi_diameter);
        let no_glass = gap <= 0.0 && surfaces[i..j].iter().any(|s| s.medium.n_d > 1.2);
        no_glass || crossing(front, rear, gap, reach).is_some()
    };
    gaps(surfaces).iter().filter(|gap| is_wrong(gap)).count()
}

/// Checks a prescription from any reader. Warnings go to `sink`. `place` returns the span of a
/// surface's value in the file. `derived` are the surfaces whose apertures are those of the beam.
///
/// # Errors
///
/// Returns the first error in the table.
pub(crate) fn check(
    prescription: &mut Prescription,
    source: &Arc<Source>,
    sink: &mut Sink,
    place: impl Fn(usize, Column) -> Span,
    derived: &[usize],
) -> Result<()> {
    let fail = |span, message: String| Diagnostic::error(message).at(source, span);
    check_count(prescription.surfaces.len(), source)?;
    if prescription.surfaces.is_empty() {
        return Err(
            fail(Span::at(0), "the lens has no surfaces".into()).with_help(
                "a lens is a table with the rows radius, thickness, index, aperture diameter, or a \
                        file of Zemax (.zmx), CODE V (.seq), OSLO (.len) and others",
            ),
        );
    }
    for (i, surface) in prescription.surfaces.iter().enumerate() {
        check_numbers(i, surface, &fail, &place)?;
        check_form(i, surface, &fail, &place)?;
        let frame = surface.frame.as_deref();
        if !frame.is_none_or(|f| f.before.is_finite() && f.after.is_finite()) {
            let message = format!("a decenter of surface {i} is not a finite number");
            return Err(fail(place(i, Column::Thickness), message));
        }
    }
    check_stops(prescription, &fail, &place)?;
    check_mirrors(prescription, sink, &fail, &place)?;
    check_backwards(prescription, &fail, &place)?;
    prescription.outline_to_iris();
    // The following may be wrong, and is only warned of.
    for (i, surface) in prescription.surfaces.iter().enumerate() {
        if let Some(name) = &surface.medium.stands_for {
            let glass = &surface.medium;
            let message = format!(
                "there is no glass named `{name}` in the table: `{}` takes its place",
                glass.name
            );
            sink.warn(place(i, Column::Index), message).help(format!(
                "its n_d is {:.5}, its V_d {:.2}; for the glass itself: --glass-catalogue FILE.agf",
                glass.n_d,
                glass.abbe().unwrap_or(f64::INFINITY)
            ));
        }
    }
    if prescription.stop().is_none() {
        sink.warn(place(0, Column::Radius), "the lens has no stop")
            .help(
                "the surface that limits a beam along the axis takes its place; \
             a stop is a row with radius 0 and index 0",
            );
    }
    note_two_terms(prescription, sink, &place);
    for (i, surface) in prescription.surfaces.iter_mut().enumerate() {
        clamp_to_radius(i, surface, sink, &place);
    }
    warn_of_gaps(prescription, sink, &place, derived);
    Ok(())
}

fn check_numbers(
    i: usize,
    surface: &Surface,
    fail: &impl Fn(Span, String) -> Box<Diagnostic>,
    place: &impl Fn(usize, Column) -> Span,
) -> Result<()> {
    let n = surface.medium.n_d;
    if !surface.curvature.per_mm().is_finite() || !surface.curvature.radius().is_finite() {
        let span = place(i, Column::Radius);
        return Err(fail(
            span,
            format!("the radius of surface {i} is not a finite number"),
        )
        .with_help("write a plane as radius 0"));
    }
    if !surface.thickness.is_finite() {
        let span = place(i, Column::Thickness);
        return Err(fail(
            span,
            format!("the thickness behind surface {i} is not a finite number"),
        ));
    }
    if !(n >= 0.999) || !n.is_finite() {
        let span = place(i, Column::Index);
        let error = fail(
            span,
            format!("the index behind surface {i} is {n}, less than 1"),
        );
        return Err(error.with_help(
            "the columns are radius, thickness, index, aperture diameter; are two of them swapped?",
        ));
    }
    if !(0.0..surface.semi_diameter).contains(&surface.obstruction) && surface.semi_diameter > 0.0 {
        let span = place(i, Column::SemiDiameter);
        let message = format!(
            "the obstruction of surface {i}, {}, is not between 0 and its semi-diameter",
            surface.obstruction
        );
        return Err(fail(span, message));
    }
    if !(surface.semi_diameter > 0.0) {
        let span = place(i, Column::SemiDiameter);
        return Err(fail(
            span,
            format!("the aperture of surface {i} is not greater than 0"),
        )
        .with_help("the last column is the diameter that lets light through"));
    }
    if let Shape::Conic { k }
    | Shape::Asphere { k, .. }
    | Shape::NormalAsphere { k, .. }
    | Shape::Toroid { k, .. } = &surface.shape
        && !k.is_finite()
    {
        let span = place(i, Column::Radius);
        return Err(fail(
            span,
            format!("the conic constant of surface {i} is not a number"),
        ));
    }
    if let Shape::Asphere { terms, .. }
    | Shape::NormalAsphere { terms, .. }
    | Shape::Toroid { terms, .. } = &surface.shape
        && terms.iter().any(|t| !t.is_finite())
    {
        let span = place(i, Column::Radius);
        return Err(fail(
            span,
            format!("a coefficient of surface {i} is not a number"),
        ));
    }
    Ok(())
}

/// Checks what makes an ideal lens, and a clear aperture that is not round.
fn check_form(
    i: usize,
    surface: &Surface,
    fail: &impl Fn(Span, String) -> Box<Diagnostic>,
    place: &impl Fn(usize, Column) -> Span,
) -> Result<()> {
    if let Shape::ThinLens { focal_length } = surface.shape {
        let span = place(i, Column::Radius);
        if !focal_length.is_finite() || focal_length == 0.0 {
            let message = format!("the focal length of the ideal lens {i} is {focal_length}");
            return Err(fail(span, message).with_help("it is a length other than 0"));
        }
        if surface.is_mirror {
            let message = format!("surface {i} is an ideal lens and a mirror");
            return Err(fail(span, message).with_help("put the ideal lens in front of a mirror"));
        }
    }
    let is_polygon = |c: &[DVec2]| c.len() >= 3 && c.iter().all(|c| c.is_finite());
    if !surface.outline.as_deref().is_none_or(is_polygon) {
        let message = format!("the outline of surface {i} is no polygon");
        return Err(fail(place(i, Column::SemiDiameter), message)
            .with_help("it has at least three corners"));
    }
    let corners = surface.outline.as_deref().map_or(0, <[DVec2]>::len);
    if corners > MAX_CORNERS {
        let message = format!("the outline of surface {i} has {corners} corners");
        return Err(
            fail(place(i, Column::SemiDiameter), message).with_help(format!(
                "it has at most {MAX_CORNERS}: leave every second one out"
            )),
        );
    }
    Ok(())
}

fn check_stops(
    prescription: &Prescription,
    fail: &impl Fn(Span, String) -> Box<Diagnostic>,
    place: &impl Fn(usize, Column) -> Span,
) -> Result<()> {
    let surfaces = &prescription.surfaces;
    let mut stops = (0..surfaces.len()).filter(|&i| surfaces[i].is_stop);
    let (first, second) = (stops.next(), stops.next());
    if let (Some(first), Some(second)) = (first, second) {
        let message = format!("surface {second} is a second stop, beside surface {first}");
        return Err(fail(place(second, Column::Radius), message)
            .with_help("give a mere diaphragm the index of its medium instead of 0"));
    }
    if let [only] = &surfaces[..]
        && (only.is_idle(&prescription.object_medium) || only.is_stop && only.is_plane())
    {
        let span = place(0, Column::Radius);
        let message = "the lens is a plane in one medium and nothing else".into();
        return Err(fail(span, message).with_help("add the rows of its surfaces"));
    }
    Ok(())
}

/// Refuses a group that moves for focusing and turns the light around: the gaps on both sides of it
/// would become longer. Notes mirrors whose middle nothing closes.
fn check_mirrors(
    prescription: &Prescription,
    sink: &mut Sink,
    fail: &impl Fn(Span, String) -> Box<Diagnostic>,
    place: &impl Fn(usize, Column) -> Span,
) -> Result<()> {
    let surfaces = &prescription.surfaces;
    let Some(first) = surfaces.iter().position(|s| s.is_mirror) else {
        return Ok(());
    };
    if let Some(FocusGroup { first, last }) = prescription.focus_group
        && surfaces[first..=last]
            .iter()
            .filter(|s| s.is_mirror)
            .count()
            % 2
            == 1
    {
        let message = "the group that moves for focusing has an odd number of mirrors";
        return Err(fail(place(first, Column::Thickness), message.into())
            .with_help("leave `focus_group` out: the whole lens then moves"));
    }
    let is_tilted = |s: &Surface| s.is_mirror && s.frame.is_some();
    if surfaces.iter().all(|s| s.obstruction == 0.0) && !surfaces.iter().any(is_tilted) {
        let message = "nothing blocks light in the middle of this lens with mirrors";
        sink.note(place(first, Column::SemiDiameter), message)
            .help("an obstruction shades the beam as the second mirror and the film do");
    }
    Ok(())
}

/// Notes the glasses that are in the table with n_d and V_d alone.
fn note_two_terms(lens: &Prescription, sink: &mut Sink, place: &impl Fn(usize, Column) -> Span) {
    let mut names: Vec<&str> = Vec::new();
    let mut first = None;
    for (i, surface) in lens.surfaces.iter().enumerate() {
        let glass = &surface.medium;
        let by_two = matches!(glass.dispersion, Dispersion::Cauchy { .. });
        let is_named = by_two && !glass.name.is_empty() && !names.contains(&&*glass.name);
        if is_named && Catalogue::builtin().find(&glass.name) == Some(glass) {
            names.push(&glass.name);
            first = first.or(Some(i));
        }
    }
    if let Some(first) = first {
        let message = format!(
            "the table has n_d and V_d alone of {}: other indices are those of a two-term formula",
            names.join(", ")
        );
        sink.note(place(first, Column::Index), message)
            .help("for the whole curve: --glass-catalogue FILE.agf");
    }
}

/// A cap cannot be wider than its sphere: rays outside it miss in any case.
fn clamp_to_radius(
    i: usize,
    surface: &mut Surface,
    sink: &mut Sink,
    place: &impl Fn(usize, Column) -> Span,
) {
    let widest = surface.widest_cap();
    if surface.semi_diameter.is_finite() && surface.semi_diameter > widest * (1.0 + 1e-12) {
        sink.warn(
            place(i, Column::SemiDiameter),
            format!(
                "the semi-diameter of surface {i} is {}, more than its radius of {widest} allows",
                surface.semi_diameter
            ),
        )
        .help("the radius is taken instead; the last column is a diameter, check for a lost digit");
        surface.semi_diameter = widest;
    }
}

/// The gaps between neighboring surfaces without the stop, which may be anywhere: the numbers of
/// the two surfaces, and their distance.
fn gaps(surfaces: &[Surface]) -> Vec<(usize, usize, f64)> {
    let refracting: Vec<usize> = (0..surfaces.len())
        .filter(|i| !surfaces[*i].is_stop)
        .collect();
    let gap = |i: usize, j: usize| surfaces[i..j].iter().map(|s| s.thickness).sum();
    let pairs = refracting.iter().zip(refracting.iter().skip(1));
    pairs.map(|(&i, &j)| (i, j, gap(i, j))).collect()
}

fn check_backwards(
    prescription: &Prescription,
    fail: &impl Fn(Span, String) -> Box<Diagnostic>,
    place: &impl Fn(usize, Column) -> Span,
) -> Result<()> {
    let surfaces = &prescription.surfaces;
    for (i, _, gap) in gaps(surfaces) {
        if gap < 0.0 && surfaces[i].medium.n_d > 1.2 {
            let message =
                format!("the thickness behind surface {i} runs backwards through glass: {gap}");
            return Err(fail(place(i, Column::Thickness), message)
                .with_help("a thickness is the distance to the next vertex, toward the film"));
        }
    }
    Ok(())
}

fn warn_of_gaps(
    prescription: &Prescription,
    sink: &mut Sink,
    place: &impl Fn(usize, Column) -> Span,
    derived: &[usize],
) {
    let surfaces = &prescription.surfaces;
    for (i, j, gap) in gaps(surfaces) {
        let (front, rear) = (&surfaces[i], &surfaces[j]);
        let span = place(i, Column::Thickness);
        if gap < 0.0 {
            sink.warn(
                span,
                format!("surface {j} is {:.3} mm in front of surface {i}", -gap),
            )
            .help(match surfaces[..j].iter().any(|s| s.is_mirror) {
                true => {
                    "behind a mirror, light travels toward smaller z and thicknesses are negative"
                }
                false => {
                    "light would travel backward between them: check the sign of the thickness"
                }
            });
        }
        // Around a stop the semi-diameters are often larger than the beam. Surfaces must not cross
        // within the stop's own semi-diameter.
        let between = surfaces[i + 1..j].iter().map(|s| s.semi_diameter);
        let reach = between.fold(front.semi_diameter.min(rear.semi_diameter), f64::min);
        if let Some(height) = crossing(front, rear, gap, reach) {
            sink.warn(
                span,
                format!("surfaces {i} and {j} cross {height:.3} mm from the axis"),
            )
            .help(match derived.contains(&i) || derived.contains(&j) {
                true => {
                    "their apertures are those of the whole beam, which is too wide there: state \
                     the apertures, or a smaller field"
                }
                false => "where light goes: check the thickness and the two radii",
            });
        }
    }
}

/// The height at which two neighboring surfaces cross nearer to the axis than `reach`, by more than
/// a thousandth of it; none if they do not, or if one is decentered, because no circle is then
/// where they cross.
fn crossing(front: &Surface, rear: &Surface, thickness: f64, reach: f64) -> Option<f64> {
    const STEPS: u32 = 64;
    let is_decentered = front.frame.is_some() || rear.frame.is_some();
    if !reach.is_finite() || thickness < 0.0 || is_decentered {
        return None;
    }
    // The next surface faces a mirror from the side that light comes from.
    let facing = if front.is_mirror { -1.0 } else { 1.0 };
    let gap = |r: f64| thickness + rear.sag(r) - facing * front.sag(r);
    let steps = (1..=STEPS).map(|i| reach * f64::from(i) / f64::from(STEPS));
    let mut outside = steps.into_iter().find(|r| gap(*r) < -1e-3 * reach)?;
    let mut inside = 0.0;
    for _ in 0..50 {
        let middle = 0.5 * (inside + outside);
        if gap(middle) < 0.0 {
            outside = middle
        } else {
            inside = middle
        }
    }
    Some(outside)
}
