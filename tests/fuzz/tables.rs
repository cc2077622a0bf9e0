//! Fuzz targets for the small text files: cameras, timelines, films, and curves of other programs.

use std::sync::Arc;

use ivcam_base::diag::Source;
use ivcam_optics::film::{Emulsion, Response};
use ivcam_render::render::report::Peer;

use ivcam::movie::Timeline;
use ivcam::photo::CameraNode;

/// Reads a camera file, writes its camera as a node, and reads that again.
pub(super) fn camera(bytes: &[u8]) {
    let Ok(node) = CameraNode::read(&String::from_utf8_lossy(bytes)) else {
        return;
    };
    let pose = node.pose();
    let is_finite = pose.position.is_finite() && pose.orientation.is_finite();
    assert!(is_finite && pose.focal_distance.is_finite(), "{pose:?}");
    let written = CameraNode::from_pose(pose);
    let again = CameraNode::read(written.text());
    let again = again.unwrap_or_else(|e| panic!("{}\n{}", written.text(), e.render(false)));
    assert_eq!(again.pose(), written.pose(), "{}", written.text());
}

/// Reads a timeline, and evaluates it at its first, middle and last frame.
pub(super) fn timeline(bytes: &[u8]) {
    let source = Arc::new(Source::new("fuzzed.txt", bytes.to_vec()));
    let Ok(timeline) = Timeline::read(&source) else {
        return;
    };
    let travel = |distance: f64| Some(50.0 * 50.0 / (1e3 * distance - 50.0).max(1.0));
    let last = timeline.frames.saturating_sub(1);
    for frame in [0, last / 2, last] {
        for moment in timeline.exposures(frame, 4, &travel) {
            let numbers = [moment.focus, moment.zoom, moment.f_number, moment.time];
            let is_nan = numbers.iter().flatten().any(|x| x.is_nan());
            let is_turned = moment.orientation.is_none_or(|q| q.is_finite());
            assert!(!is_nan && is_turned, "frame {frame}: {moment:?}");
        }
    }
}

/// Reads the table of a film, and develops exposures with it.
pub(super) fn film(bytes: &[u8]) {
    let source = Arc::new(Source::new("fuzzed.txt", bytes.to_vec()));
    let Ok(film) = Emulsion::read(&source) else {
        return;
    };
    let response = Response::Film(Arc::new([film]));
    for exposure in [0.0, 1e-30, 0.18, 1.0, 1e30, f64::INFINITY, f64::NAN] {
        for channel in 0..3 {
            let level = response.level(exposure, channel);
            assert!((0.0..=1.0).contains(&level), "{exposure}: {level}");
        }
    }
}

/// Reads the curves of other programs for the convergence table.
pub(super) fn curves(bytes: &[u8]) {
    for peer in Peer::parse(&String::from_utf8_lossy(bytes)).unwrap_or_default() {
        assert!(peer.rel_rmse > 0.0, "{peer:?}");
    }
}
