//! Reads a prescription. The format is recognized by the content of a file, not by its name.

use std::sync::Arc;

use ivcam_base::diag::{Result, Sink, Source, Span};

use crate::prescription::formats::FORMATS;
use crate::prescription::formats::apertures;
use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::formats::reading::Reading;
use crate::prescription::prescription::Prescription;
use crate::prescription::text;

/// Reads a prescription in any known format.
///
/// # Errors
/// Returns the errors of `read_with`.
pub fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    read_with(source, &Reading::default(), sink)
}

/// Reads a prescription in any known format, with given glasses and options.
///
/// # Errors
///
/// Returns an error if the file is in no known format, and the errors of its reader.
pub(crate) fn read_with(
    source: &Arc<Source>,
    how: &Reading,
    sink: &mut Sink,
) -> Result<Prescription> {
    let source = &text::decoded(source);
    let before = sink.set_source(Some(source.clone()));
    let file = PrescriptionReader {
        source,
        options: how,
    };
    let result = refuse_unknown(file).and_then(|()| {
        let format = FORMATS
            .iter()
            .find(|format| (format.recognizes)(file.text()));
        let mut lens = match format {
            Some(format) => (format.read)(file, sink),
            None => Err(file.fail(Span::at(0), "this is not a lens prescription")),
        }?;
        apertures::close_open_stop(&mut lens, sink);
        apertures::warn_if_afocal(&lens, sink);
        if how.as_published {
            Ok(lens)
        } else {
            lens.at_nominal_size()
        }
    });
    sink.set_source(before);
    result
}

/// Refuses files that are not prescriptions, and names the programs whose formats are not read.
fn refuse_unknown(file: PrescriptionReader<'_>) -> Result<()> {
    if let Some(at) = file.text().find('\0') {
        let message = "this is not text, so it is not a lens prescription";
        let help = "of a Zemax archive (.zar, .zos) open and save the lens as `.zmx`";
        return Err(file.refuse(Span::at(at), message, help));
    }
    if is_catalogue(file.text()) {
        let message = "this is a glass catalogue, not a lens";
        let help = "give it as --glass-catalogue FILE.agf";
        return Err(file.refuse(Span::at(0), message, help));
    }
    Ok(())
}

/// Whether a text is an `.agf` file. Its first line may be any comment, so it is recognized by the
/// lines that name glasses and list their coefficients.
fn is_catalogue(text: &str) -> bool {
    let begins = |key: &str| text.lines().any(|line| line.starts_with(key));
    begins("NM ") && begins("CD ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::formats::write;

    #[test]
    fn a_format_is_known_by_what_the_file_says() {
        for (text, name) in [
            ("# Inch\n10 2 1.5 9\n", "four columns"),
            ("VERS 1\r\nMODE SEQ\r\n", "Zemax"),
            ("RDM;LEN \"x\"\n", "CODE V"),
            ("! old\nlen\ntit 'x'\n", "CODE V"),
            (" {\"surfaces\": []}", "JSON"),
            ("{\"surfaces\": [{\"semi_aperture\": 1}]}", "JSON of ISET"),
            (" {\"surface_group\": {}}", "optiland"),
            ("{\"optical_model\": {\"seq_model\": 1}}", "ray-optics"),
            ("[Lens Data]\n1\t2\t3\n", "Optical Bench"),
            ("name: a\n surfaces:\n10 2 1.5 60 9 1\n", "lens flare table"),
            (
                "[Metadata]\nName: a\n[Elements]\nRadius Thickness\n",
                "crayg",
            ),
            (
                "# own\n35 2 bk7 1.5 54 15\n-35 1/2/3 air 15\n",
                "lensoptics",
            ),
            ("// OSLO 6\nLEN NEW \"a\"\nTH 1e20\nNXT // 1\n", "OSLO"),
            ("", "four columns"),
        ] {
            let format = FORMATS.iter().find(|f| (f.recognizes)(text)).unwrap();
            assert_eq!(format.name, name, "{text}");
        }
        for text in [
            "CC a\nNM A 2\nCD 1 2\n",
            "Copied with permission.\r\nCC a\nNM A 2\nCD 1 2\n",
        ] {
            let agf = Source::new("a.agf", text.as_bytes().to_vec());
            let error = read(&Arc::new(agf), &mut Sink::new()).unwrap_err();
            assert!(error.message.contains("glass catalogue"));
        }
    }

    #[test]
    fn what_is_not_text_is_refused() {
        let source = Arc::new(Source::new("a", b"ab\ncd\0\x01".to_vec()));
        let error = read(&source, &mut Sink::new()).unwrap_err();
        assert!(error.message.contains("not text"), "{error}");
        assert_eq!(error.location().1, Some((2, 3)), "{error}");
    }

    #[test]
    fn a_missing_zoom_position_is_reported_at_the_list_of_positions() {
        let place = |name: &str| {
            let lens = crate::lens::Lens::named(name).unwrap();
            let error = lens.at_zoom(9).unwrap_err();
            let error = crate::lens::at_zoom_list(error, name);
            let (file, at) = error.location();
            (file.unwrap().to_owned(), at.unwrap())
        };
        let (file, (line, column)) = place("canon-70-200");
        assert_eq!(file, "lenses/zoom/canon-70-200.json");
        assert!(line > 5 && column == 2, "{line}:{column}");
        assert_eq!(place("double-gauss").1, (1, 1));
    }

    /// Files with bytes removed, doubled and changed give a lens or an error, and never a panic.
    #[test]
    fn a_damaged_file_is_a_message_and_never_a_panic() {
        let seq = "RDM;LEN\nTITLE 'a'\nDIM M\nEPD 5\nYAN 0 10\nPRV\n PWL 700 486\n 'X' 1.5 1.6\nEND\n\
                   SO 0 1e9\nS 50 3 NBK7_SCHOTT\n CIR 9\n STO\nS -40 2 517642\n ASP; K -1; A 1e-6\n\
                   S -90 95\n CIR 8\nZOO 2\nZOO THI S2 1 2\nSI 0 0\nGO\n";
        let bench = "[constants]\nAsphericalOddCount\t1\n[variable distances]\nFocal Length\t50\t70\n\
                     d2\t1\t9\n[lens data]\n1\t50\t5\t1.5\t20\t60\n2\t-50\td2\t\t20\n3\tAS\t40\t\t9\n\
                     [aspherical data]\n1\t50\t-0.5\t1e-6\t1e-7\n";
        let flare =
            "name: a\nsurfaces:\n50 5 1.5 60 9 1\n-50 3 1 0 9 0 toric -60\nstop 40 1 0 5 0\n";
        let oslo = "LEN NEW \"a\" 50 3\nEBR 5; UNI 1.0; WV .587 .486 .656\nTH 1e20\nNXT\nGLA MOD A 1.5 1.51 \
                    1.49\nRD 50\nTH 5\nAP CHK 9\nCC -1\nAD 1e-6\nNXT\nAIR\nRD -50\nTH 40\nAST\nNXT\nEND 3\n";
        let optiland = r#"{"surface_group": {"surfaces": [{"geometry": {"type": "Plane", "cs": {"z": -Infinity}}},
            {"geometry": {"type": "EvenAsphere", "cs": {"z": 0.0}, "radius": 50, "conic": -1,
             "coefficients": [0, 1e-6]}, "material_post": {"type": "AbbeMaterial", "index": 1.5, "abbe": 60},
             "is_stop": true},
            {"geometry": {"type": "StandardGeometry", "cs": {"z": 5.0}, "radius": -50},
             "material_post": {"type": "IdealMaterial", "index": 1.0}, "aperture": {"r_max": 9}},
            {"geometry": {"type": "Plane", "cs": {"z": 50.0}, "radius": Infinity}}]},
            "aperture": {"type": "EPD", "value": 10}}"#;
        let roa = r#"{"optical_model": {"attributes": {"system_spec": {"attributes": {"_dimensions": "mm"}},
            "profile_dict": {"1": {"__instance_type__": ["a", "Spherical"], "attributes": {"cv": 0.02}}},
            "seq_model": {"attributes": {"stop_surface": 1, "ifcs": [{"attributes": {}},
             {"__instance_type__": ["a", "Surface"], "attributes": {"interact_mode": "transmit",
              "max_aperture": 9, "profile_id": "1"}},
             {"__instance_type__": ["a", "Surface"], "attributes": {"interact_mode": "transmit",
              "profile": {"__instance_type__": ["a", "EvenPolynomial"], "attributes": {"cv": -0.02, "cc": -1,
              "coefs": {"__ndarray__": [0, 1e-6]}}}}}, {"attributes": {}}],
             "gaps": [{"attributes": {"thi": Infinity, "medium": {"__instance_type__": ["a", "Air"]}}},
              {"attributes": {"thi": 5, "medium": {"attributes": {"n": 1.5, "v": 60}}}},
              {"attributes": {"thi": 40, "medium": {"__instance_type__": ["a", "Air"]}}}]}}}}}"#;
        let crayg = "[Metadata]\nName: a\n[Surfaces]\n50 5 1.5 9 60 SCHOTT_N_BK7 ASPHERICAL\n\
                     -50 9 1 9 0 AIR SPHERICAL\n0 40 0 5 0 AIR PLANAR\n[Aspheric Coefficients]\n\
                     0: k=-1 a4=1e-6\n[Variable Distances]\nFocal Length Samples: 50 70\n1: 3 9\n";
        let lensoptics = "# own\n#!scale 2\n50 5 cx_bk7 1.5 60 9 #!aspheric=0,1e-6\n\
                          -50 3/4/5 air 9\n1e5 40 iris 5\n";
        let mut texts: Vec<String> = [seq, bench, flare, oslo, optiland, roa, crayg, lensoptics]
            .map(str::to_owned)
            .to_vec();
        for text in &texts {
            let source = Arc::new(Source::new("whole", text.clone().into_bytes()));
            let whole = read(&source, &mut Sink::new());
            assert!(whole.is_ok(), "{text}: {}", whole.unwrap_err());
        }
        for name in ["double-gauss", "canon-70-200", "phone"] {
            let lens = crate::lens::Lens::named(name).unwrap();
            for target in [
                write::OutputFormat::Columns,
                write::OutputFormat::Zemax,
                write::OutputFormat::Json,
            ] {
                texts.extend(write::write(lens.prescription(), target).map(|(text, _)| text));
            }
        }
        let mut state = 1_u64;
        let mut random = |below: usize| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize % below.max(1)
        };
        let mut read_well = 0;
        for round in 0..3000 {
            let mut bytes = texts[round % texts.len()].clone().into_bytes();
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes.truncate(at),
                    1 => bytes[at] = b"-0.9e;&\"\n{}[],x \xff\0"[random(18)],
                    2 => drop(bytes.drain(at..(at + random(40)).min(bytes.len()))),
                    _ => bytes.insert(at, bytes[at]),
                }
                if bytes.is_empty() {
                    break;
                }
            }
            let source = Arc::new(Source::new("damaged", bytes));
            read_well += usize::from(read(&source, &mut Sink::new()).is_ok());
        }
        assert!(read_well > 100, "{read_well}");
    }
}
