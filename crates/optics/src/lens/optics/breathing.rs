//! Focus breathing: how the field and the exposure change when the lens is focused nearer.

use ivcam_base::math::Meters;
use serde::Serialize;

use crate::lens::lens::Lens;
use crate::lens::optics::focus::{Focus, FocusMethod};
use crate::prescription::surface::Meridian;

/// The field and the exposure of a lens focused at one distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Breathing {
    /// The focus distance in millimeters, as the focus method measures it; none for infinity.
    pub distance: Option<f64>,
    /// The image height over the object height; negative if the image is upside down.
    pub magnification: f64,
    /// The distance by which the film, or the part that focuses, has moved, in millimeters.
    pub extension: f64,
    /// The angle between the chief rays of the ends of the film's diagonal, or of its lit part, in
    /// degrees.
    pub field_degrees: Option<f64>,
    /// The field over the field at infinity, less 1, in percent.
    pub field_change_percent: Option<f64>,
    /// The f-number that determines the exposure: N (1 − m/p), where N is the f-number by real rays
    /// and p the magnification of the pupils.
    pub working_f_number: Option<f64>,
}

impl Lens {
    /// The focus method that moves the focusing group, if the prescription has one, and otherwise
    /// the film.
    pub(crate) fn default_focus_method(&self) -> FocusMethod {
        match self.prescription().focus_group {
            Some(_) => FocusMethod::Group,
            None => FocusMethod::Film,
        }
    }

    /// The field and the exposure at infinity, 10 m, 1 m and the nearest distance. The nearest
    /// distance is that at which the focusing group ends. A film that moves has no such end, and
    /// life size is used. `image_height` is half of the film's diagonal, in millimeters.
    pub fn breathing(&self, method: FocusMethod, image_height: f64) -> Vec<Breathing> {
        let mut distances = vec![f64::INFINITY, 10.0, 1.0];
        distances.extend(self.nearest(method).filter(|d| *d < 10.0 && *d != 1.0));
        let nearest = distances[3..].first().copied().unwrap_or(0.0);
        let mut rows: Vec<Breathing> = Vec::new();
        for distance in distances.into_iter().filter(|d| *d >= nearest) {
            let Ok((lens, focus)) = self.focused(method, Meters(distance)) else {
                continue;
            };
            let mut row = lens.breathing_at(&focus, image_height);
            let wide = rows.first().map_or(row.field_degrees, |r| r.field_degrees);
            let change = |(now, then): (f64, f64)| 100.0 * (now / then - 1.0);
            let field = row.field_degrees.zip(wide).filter(|(_, wide)| *wide > 0.0);
            row.field_change_percent = field.map(change);
            rows.push(row);
        }
        rows
    }

    /// The field and the exposure of this lens at its focus.
    fn breathing_at(&self, focus: &Focus, image_height: f64) -> Breathing {
        let optics = self.first_order();
        let pupils = optics.entrance_pupil.zip(optics.exit_pupil);
        let magnified = pupils.map(|(en, ex)| ex.semi_diameter / en.semi_diameter);
        let working = |(n, p): (f64, f64)| n * (1.0 + focus.magnification.abs() / p);
        let height = self.lit_height(image_height, focus.film_z);
        let chief = self.distortion(Meridian::Y, height, focus.film_z);
        Breathing {
            distance: focus.distance.is_finite().then_some(focus.distance),
            magnification: if focus.distance.is_finite() {
                focus.magnification
            } else {
                0.0
            },
            extension: focus.extension,
            field_degrees: chief.map(|c| 2.0 * c.angle.to_degrees()),
            field_change_percent: None,
            working_f_number: self.real_f_number().zip(magnified).map(working),
        }
    }

    /// The nearest distance to be listed, in meters.
    fn nearest(&self, method: FocusMethod) -> Option<f64> {
        let focal = self.first_order().focal?;
        if method == FocusMethod::Group {
            // The fault for a distance that is far too near names the nearest distance.
            let fault = self.focus(method, Meters(1e-3 * focal.efl.abs())).err()?;
            return fault.nearest().filter(|d| d.is_finite()).map(|d| 1e-3 * d);
        }
        // Life size: a focal length in front of the front focal point.
        let life_size = 1e-3 * (focal.front_efl - focal.ffl);
        (focal.efl > 0.0 && life_size > 0.0).then_some(life_size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_that_moves_back_for_life_size_doubles_the_f_number_of_a_symmetric_lens() {
        let lens = Lens::named("cooke-triplet").unwrap();
        let rows = lens.breathing(FocusMethod::Film, 10.0);
        let (far, near) = (rows[0], rows[rows.len() - 1]);
        assert_eq!(far.magnification, 0.0);
        assert!((near.magnification + 1.0).abs() < 1e-9, "{near:?}");
        let twice = near.working_f_number.unwrap() / far.working_f_number.unwrap();
        assert!((twice - 2.0).abs() < 0.2, "{twice}");
        // The film is twice as far from the lens: half of the field, nearly.
        let field = near.field_change_percent.unwrap();
        assert!((field + 50.0).abs() < 5.0, "{field}");
        assert!(
            rows.windows(2)
                .all(|r| r[0].field_degrees > r[1].field_degrees)
        );
    }
}
