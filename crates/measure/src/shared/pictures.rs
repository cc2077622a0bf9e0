//! Pictures that several measurements take, on one thread.

use std::fmt::Write as _;
use std::path::PathBuf;

use ivcam::photo::{CameraChoice, Era, LensChoice, Optics, Plan, Session};
use ivcam_base::diag::Result;
use ivcam_optics::film::Resolution;
use ivcam_optics::sampling::Sampler;
use ivcam_render::render::{Exposure, Stop};

use super::mesh;

/// Runs work on this thread only.
pub(crate) fn one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread();
    match pool.build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

/// Returns the processor time of this thread in seconds, or the clock's time if the system does not
/// provide it.
pub(crate) fn thread_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.map_or_else(
        || {
            let since = std::time::SystemTime::UNIX_EPOCH.elapsed();
            since.unwrap_or_default().as_secs_f64()
        },
        |n| n * 1e-9,
    )
}

/// Returns a plan for the living room through a wide-angle lens.
pub(crate) fn living_room() -> Plan {
    let mut plan = Plan::of_era(Era::Modern, "scenes/livroom/livroom.iv");
    plan.camera = Some(CameraChoice::File("camera/cam-1.dat".into()));
    plan.focus = Some(ivcam_base::math::Meters(1.2));
    let mut lens = LensChoice::named("wide-angle");
    lens.efl = Some(ivcam_base::math::Mm(20.0));
    plan.optics = Optics::Lens(lens);
    plan.resolution = Resolution::of(360, 240);
    plan
}

/// Renders on this thread, and returns the seconds of rendering and the exposure.
pub(crate) fn render(session: &Session, samples: u32) -> (f64, Exposure) {
    let sampler = Sampler {
        samples,
        ..session.plan.pixel_sampler()
    };
    one_thread(|| {
        let start = thread_seconds();
        let made = session.expose_with(sampler, Stop::after(samples), &|_| ());
        (thread_seconds() - start, made)
    })
}

/// Returns the folder of the scenes that this process writes.
fn folder() -> PathBuf {
    std::env::temp_dir().join(format!("ivcam-speed-{}", std::process::id()))
}

/// Writes a scene file and returns its path.
pub(crate) fn saved(name: &str, text: &str) -> Option<PathBuf> {
    std::fs::create_dir_all(folder()).ok()?;
    let file = folder().join(name);
    std::fs::write(&file, text).ok()?;
    Some(file)
}

/// Removes the scenes that this process has written.
pub(crate) fn remove_saved() {
    // Usually none has been written.
    let _ = std::fs::remove_dir_all(folder());
}

/// Returns the largest memory of this process so far in kB, if the system reports it.
pub(crate) fn peak_kilobytes() -> Option<u64> {
    peak_kilobytes_of("/proc/self/status")
}

/// Returns the largest memory so far in kB of the process with a status file.
pub(crate) fn peak_kilobytes_of(status: &str) -> Option<u64> {
    let status = std::fs::read_to_string(status).ok()?;
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    peak.split_whitespace().next()?.parse().ok()
}

/// Returns a plan for a scene, 180x120 pixels through a wide-angle lens.
pub(crate) fn plan_of(scene: impl Into<PathBuf>) -> Plan {
    let mut plan = Plan::of_era(Era::Modern, scene);
    plan.optics = living_room().optics;
    plan.resolution = Resolution::of(180, 120);
    plan
}

/// Writes a scene, with a camera at (0, 0, 4) before its nodes, and returns a plan for it.
pub(crate) fn written(name: &str, nodes: &str) -> Option<Plan> {
    let text = format!(
        "#Inventor V2.1 ascii\nPerspectiveCamera {{ position 0 0 4 focalDistance 4 }}\n{nodes}"
    );
    saved(name, &text).map(plan_of)
}

/// Opens a plan whose scene gives no reason for a diagnostic, such as a misspelt field.
///
/// # Errors
/// Returns the first diagnostic if there is one.
pub(crate) fn opened(plan: Plan) -> Result<Session> {
    let session = Session::open(plan)?;
    match session.sink.items().first() {
        Some(found) => Err(Box::new(found.clone())),
        None => Ok(session),
    }
}

/// Returns a bumpy sphere as nodes of a file.
pub(crate) fn ball_nodes(count: usize) -> String {
    let mut points = String::new();
    let triangles = mesh::ball(count);
    for corner in triangles.iter().flatten() {
        let _ = writeln!(points, "{} {} {},", corner.x, corner.y, corner.z);
    }
    let mut faces = String::new();
    for i in 0..triangles.len() {
        let _ = writeln!(faces, "{},{},{},-1,", 3 * i, 3 * i + 1, 3 * i + 2);
    }
    format!(
        "Coordinate3 {{ point [ {points} ] }}\n\
         IndexedFaceSet {{ coordIndex [ {faces} ] }}\n"
    )
}
