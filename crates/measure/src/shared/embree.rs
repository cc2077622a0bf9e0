//! Embree 4, loaded from a shared library: trees over triangles, and rays through them.
//!
//! The structures are those of `rtcore_ray.h` and `rtcore_scene.h` of Embree 4.4. Errors of its
//! functions are reported after a tree is built; the library is never unloaded.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::ptr::{null, null_mut};

use glam::Vec3;
use libloading::Library;

use super::mesh::Rays;
use super::rays::{PeerTree, PeerTrees};

/// Marks a ray without a hit.
const NO_GEOMETRY: u32 = u32::MAX;
/// `RTC_RAY_QUERY_FLAG_COHERENT`.
const COHERENT: c_uint = 1 << 16;

/// `RTCRayHit` where `N` is 1, `RTCRayHit8` where it is 8, and `RTCRayHit16` where it is 16. It
/// starts with an `RTCRay`.
#[repr(C, align(64))]
struct RayHits<const N: usize> {
    origin: [[f32; N]; 3],
    t_near: [f32; N],
    direction: [[f32; N]; 3],
    time: [f32; N],
    /// The greatest distance, which a hit replaces by its own, or by −∞ where any hit ends a ray.
    t_far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
    normal: [[f32; N]; 3],
    uv: [[f32; N]; 2],
    primitive: [u32; N],
    geometry: [u32; N],
    /// Numbers of instances: two for each level of instancing, of which a library has one unless
    /// it is built with more.
    instances: [[u32; N]; 16],
}

impl<const N: usize> RayHits<N> {
    fn new() -> Self {
        Self {
            origin: [[0.0; N]; 3],
            t_near: [0.0; N],
            direction: [[0.0; N]; 3],
            time: [0.0; N],
            t_far: [0.0; N],
            mask: [u32::MAX; N],
            id: [0; N],
            flags: [0; N],
            normal: [[0.0; N]; 3],
            uv: [[0.0; N]; 2],
            primitive: [0; N],
            geometry: [NO_GEOMETRY; N],
            instances: [[NO_GEOMETRY; N]; 16],
        }
    }

    fn set(&mut self, lane: usize, ray: &ivcam_render::bvh::Ray) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
        self.t_far[lane] = ray.t_max;
        self.geometry[lane] = NO_GEOMETRY;
    }
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`.
#[repr(C)]
struct Arguments {
    flags: c_uint,
    features: c_uint,
    context: *mut c_void,
    filter: *const c_void,
    callback: *const c_void,
    /// A library built with a least width of curves reads it.
    least_width: f32,
}

/// The lanes of a packet that hold a ray: −1, or 0.
#[repr(C, align(64))]
struct Valid<const N: usize>([c_int; N]);

/// A function that traces a packet.
type TracePacket<const N: usize> =
    unsafe extern "C" fn(*const Valid<N>, SceneHandle, *mut RayHits<N>, *const Arguments);

/// Declares functions of the library, under their own names.
macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        #[allow(non_snake_case)]
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            fn of(library: &Library) -> Result<Self, libloading::Error> {
                Ok(Self {
                    // SAFETY: the types are those of Embree 4's headers.
                    $($name: *unsafe { library.get(stringify!($name).as_bytes())? },)*
                })
            }
        }
    };
}

type Device = *mut c_void;
type Geometry = *mut c_void;
type SceneHandle = *mut c_void;

functions! {
    rtcNewDevice(*const c_char) -> Device;
    rtcGetDeviceProperty(Device, c_int) -> isize;
    rtcGetDeviceError(Device) -> c_int;
    rtcNewScene(Device) -> SceneHandle;
    rtcSetSceneFlags(SceneHandle, c_int);
    rtcSetSceneBuildQuality(SceneHandle, c_int);
    rtcNewGeometry(Device, c_int) -> Geometry;
    rtcSetNewGeometryBuffer(Geometry, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
    rtcCommitGeometry(Geometry);
    rtcAttachGeometry(SceneHandle, Geometry) -> c_uint;
    rtcReleaseGeometry(Geometry);
    rtcCommitScene(SceneHandle);
    rtcReleaseScene(SceneHandle);
    rtcIntersect1(SceneHandle, *mut RayHits<1>, *const Arguments);
    rtcOccluded1(SceneHandle, *mut RayHits<1>, *const Arguments);
    rtcIntersect8(*const Valid<8>, SceneHandle, *mut RayHits<8>, *const Arguments);
    rtcOccluded8(*const Valid<8>, SceneHandle, *mut RayHits<8>, *const Arguments);
    rtcIntersect16(*const Valid<16>, SceneHandle, *mut RayHits<16>, *const Arguments);
    rtcOccluded16(*const Valid<16>, SceneHandle, *mut RayHits<16>, *const Arguments);
}

/// How a tree is built and traced.
#[derive(Clone, Copy)]
struct Mode {
    /// `RTCBuildQuality`.
    quality: c_int,
    /// `RTCSceneFlags`.
    flags: c_int,
}

/// The names of [`MODES`].
const NAMES: [&str; 3] = ["Embree", "Embree, high quality", "Embree, robust"];

/// Embree's own choice (medium quality); a tree of high quality, whose boxes may split triangles;
/// and rays that, like ivcam's, do not slip between triangles.
const MODES: [Mode; 3] = [
    Mode {
        quality: 1,
        flags: 0,
    },
    Mode {
        quality: 2,
        flags: 0,
    },
    Mode {
        quality: 1,
        flags: 1 << 2,
    },
];

/// The library with a device of one thread.
pub(super) struct Embree {
    functions: Functions,
    device: Device,
}

impl Embree {
    /// Loads the library at a path.
    pub(super) fn load(path: &str) -> Result<Self, String> {
        // SAFETY: loading Embree has no effect but that of its initializers.
        let library = unsafe { Library::new(path) }.map_err(|error| error.to_string())?;
        let functions = Functions::of(&library).map_err(|error| error.to_string())?;
        std::mem::forget(library);
        // SAFETY: the configuration is a string of C.
        let device = unsafe { (functions.rtcNewDevice)(c"threads=1".as_ptr()) };
        if device.is_null() {
            return Err(format!("{path} makes no device"));
        }
        Ok(Self { functions, device })
    }

    /// Returns a property of the device.
    fn property(&self, property: c_int) -> isize {
        // SAFETY: the device exists.
        unsafe { (self.functions.rtcGetDeviceProperty)(self.device, property) }
    }

    /// Returns the rays of a packet: 16 if the library has instructions for as many on this
    /// processor, else 8. It splits larger packets than that into single rays.
    fn packet(&self) -> usize {
        const NATIVE_RAY16: c_int = 34; // RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED
        match self.property(NATIVE_RAY16) {
            0 => 8,
            _ => 16,
        }
    }
}

impl PeerTrees for Embree {
    fn program(&self) -> String {
        // `RTC_DEVICE_PROPERTY_VERSION_MAJOR`, `_MINOR` and `_PATCH`.
        let [major, minor, patch] = [1, 2, 3].map(|part| self.property(part));
        format!(
            "Embree {major}.{minor}.{patch} (packets of {})",
            self.packet()
        )
    }

    fn modes(&self) -> &'static [&'static str] {
        &NAMES
    }

    fn tree(&self, mode: usize, triangles: &[[Vec3; 3]]) -> Box<dyn PeerTree + '_> {
        const VERTICES: (c_int, c_int) = (1, 0x9003); // RTC_FORMAT_FLOAT3
        const INDICES: (c_int, c_int) = (0, 0x5003); // RTC_FORMAT_UINT3
        let f = &self.functions;
        // SAFETY: every handle is of this device and in use; 0 is `RTC_GEOMETRY_TYPE_TRIANGLE`. The
        // new buffers have the sizes that are asked for, and each is written within its own.
        unsafe {
            let handle = (f.rtcNewScene)(self.device);
            (f.rtcSetSceneFlags)(handle, MODES[mode].flags);
            (f.rtcSetSceneBuildQuality)(handle, MODES[mode].quality);
            let geometry = (f.rtcNewGeometry)(self.device, 0);
            let buffer = |(kind, format), count| {
                (f.rtcSetNewGeometryBuffer)(geometry, kind, 0, format, 12, count)
            };
            let vertices = buffer(VERTICES, 3 * triangles.len());
            let indices = buffer(INDICES, triangles.len()).cast::<u32>();
            assert!(!vertices.is_null() && !indices.is_null(), "no memory");
            vertices
                .cast::<[Vec3; 3]>()
                .copy_from_nonoverlapping(triangles.as_ptr(), triangles.len());
            for k in 0..3 * triangles.len() {
                indices.add(k).write(k as u32);
            }
            (f.rtcCommitGeometry)(geometry);
            (f.rtcAttachGeometry)(handle, geometry);
            (f.rtcReleaseGeometry)(geometry);
            Box::new(EmbreeTree {
                embree: self,
                handle,
            })
        }
    }
}

/// Triangles and their tree.
struct EmbreeTree<'a> {
    embree: &'a Embree,
    handle: SceneHandle,
}

impl Drop for EmbreeTree<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is released once.
        unsafe { (self.embree.functions.rtcReleaseScene)(self.handle) };
    }
}

impl PeerTree for EmbreeTree<'_> {
    /// # Panics
    /// Panics if Embree reports an error.
    fn build(&self) {
        let f = &self.embree.functions;
        // SAFETY: the scene and its device exist.
        let error = unsafe {
            (f.rtcCommitScene)(self.handle);
            (f.rtcGetDeviceError)(self.embree.device)
        };
        assert_eq!(error, 0, "Embree reports an error");
    }

    fn one_by_one(&self, rays: &Rays, distances: &mut [f32]) {
        let f = &self.embree.functions;
        let trace = if rays.any {
            f.rtcOccluded1
        } else {
            f.rtcIntersect1
        };
        let mut one = RayHits::<1>::new();
        for (ray, distance) in rays.rays.iter().zip(distances) {
            one.set(0, ray);
            // SAFETY: the tree is built, and the ray is valid. No arguments are the default ones.
            unsafe { trace(self.handle, &raw mut one, null()) };
            *distance = one.t_far[0];
        }
    }

    fn has_packets(&self) -> bool {
        true
    }

    fn in_packets(&self, rays: &Rays, coherent: bool, distances: &mut [f32]) {
        let f = &self.embree.functions;
        match (self.embree.packet(), rays.any) {
            (16, true) => self.in_packets_of(f.rtcOccluded16, rays, coherent, distances),
            (16, false) => self.in_packets_of(f.rtcIntersect16, rays, coherent, distances),
            (_, true) => self.in_packets_of(f.rtcOccluded8, rays, coherent, distances),
            (_, false) => self.in_packets_of(f.rtcIntersect8, rays, coherent, distances),
        }
    }
}

impl EmbreeTree<'_> {
    fn in_packets_of<const N: usize>(
        &self,
        trace: TracePacket<N>,
        rays: &Rays,
        coherent: bool,
        distances: &mut [f32],
    ) {
        let arguments = Arguments {
            flags: if coherent { COHERENT } else { 0 },
            features: c_uint::MAX,
            context: null_mut(),
            filter: null(),
            callback: null(),
            least_width: 0.0,
        };
        let mut packet = RayHits::<N>::new();
        let parts = rays.rays.chunks(N).zip(distances.chunks_mut(N));
        for (some, distances) in parts {
            let mut valid = Valid([-1; N]);
            valid.0[some.len()..].fill(0);
            for (lane, ray) in some.iter().enumerate() {
                packet.set(lane, ray);
            }
            // SAFETY: the tree is built, the lanes that are marked hold rays, and the arguments
            // are complete.
            unsafe {
                trace(
                    &raw const valid,
                    self.handle,
                    &raw mut packet,
                    &raw const arguments,
                )
            };
            distances.copy_from_slice(&packet.t_far[..some.len()]);
        }
    }
}
