//! TinyBVH, through the shared library of `tinybvh_rays.cpp`: trees over triangles, and rays
//! through them one by one.

#![allow(unsafe_code)]

use std::ffi::c_void;

use glam::Vec3;
use libloading::Library;

use super::mesh::Rays;
use super::rays::{PeerTree, PeerTrees};

type Handle = *mut c_void;
type TraceRay<T> = unsafe extern "C" fn(Handle, *const f32, *const f32, f32) -> T;

/// The functions of the library, which is never unloaded.
pub(super) struct TinyBvh {
    version: u32,
    /// The greatest distance of a ray.
    far: f32,
    new: unsafe extern "C" fn(*const f32, u32) -> Handle,
    free: unsafe extern "C" fn(Handle),
    build: unsafe extern "C" fn(Handle, bool),
    nearest: TraceRay<f32>,
    is_blocked: TraceRay<bool>,
}

impl TinyBvh {
    /// Loads the library at a path.
    pub(super) fn load(path: &str) -> Result<Self, String> {
        let load = || -> Result<Self, libloading::Error> {
            // SAFETY: loading the library has no effect, and the types are those of
            // `tinybvh_rays.cpp`.
            unsafe {
                let library = Library::new(path)?;
                let version = library.get::<unsafe extern "C" fn() -> u32>(b"tinybvh_version")?;
                let far = library.get::<unsafe extern "C" fn() -> f32>(b"tinybvh_far")?;
                let loaded = Self {
                    version: version(),
                    far: far(),
                    new: *library.get(b"tinybvh_new")?,
                    free: *library.get(b"tinybvh_free")?,
                    build: *library.get(b"tinybvh_build")?,
                    nearest: *library.get(b"tinybvh_nearest")?,
                    is_blocked: *library.get(b"tinybvh_is_blocked")?,
                };
                std::mem::forget(library);
                Ok(loaded)
            }
        };
        load().map_err(|error| error.to_string())
    }
}

impl PeerTrees for TinyBvh {
    fn program(&self) -> String {
        let [_, major, minor, sub] = self.version.to_be_bytes();
        format!("TinyBVH {major}.{minor}.{sub}")
    }

    fn modes(&self) -> &'static [&'static str] {
        &["TinyBVH", "TinyBVH, split triangles"]
    }

    fn tree(&self, mode: usize, triangles: &[[Vec3; 3]]) -> Box<dyn PeerTree + '_> {
        let (first, count) = (triangles.as_ptr().cast(), triangles.len() as u32);
        Box::new(TinyTree {
            tiny: self,
            splits: mode == 1,
            // SAFETY: the library reads nine coordinates of each triangle.
            handle: unsafe { (self.new)(first, count) },
        })
    }
}

/// Triangles and their tree.
struct TinyTree<'a> {
    tiny: &'a TinyBvh,
    /// Whether boxes may split triangles.
    splits: bool,
    handle: Handle,
}

impl Drop for TinyTree<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is freed once.
        unsafe { (self.tiny.free)(self.handle) };
    }
}

impl PeerTree for TinyTree<'_> {
    fn build(&self) {
        // SAFETY: the tree exists.
        unsafe { (self.tiny.build)(self.handle, self.splits) };
    }

    fn one_by_one(&self, rays: &Rays, distances: &mut [f32]) {
        let far = self.tiny.far;
        for (ray, distance) in rays.rays.iter().zip(distances) {
            let (from, toward) = (ray.origin.to_array(), ray.direction.to_array());
            let reach = ray.t_max.min(far);
            // SAFETY: the tree is built, and the library reads three coordinates of each.
            *distance = unsafe {
                let (from, toward) = (from.as_ptr(), toward.as_ptr());
                if !rays.any {
                    (self.tiny.nearest)(self.handle, from, toward, reach)
                } else if (self.tiny.is_blocked)(self.handle, from, toward, reach) {
                    f32::NEG_INFINITY
                } else {
                    ray.t_max
                }
            };
            if *distance >= far {
                *distance = f32::INFINITY;
            }
        }
    }
}
