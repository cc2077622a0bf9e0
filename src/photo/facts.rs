//! What determines the bits of a picture: names and values that two runs or two processes compare.

use indexmap::IndexMap;
use ivcam_base::files::Inputs;
use ivcam_base::math::simd::arithmetic;
use ivcam_optics::sampling::SamplerKind;

use super::checkpoint::Facts;
use super::plan::Plan;
use super::session::{FREE, Session};

impl Session {
    /// Returns what determines the picture, besides its region and its number of samples. `inputs`
    /// are the files that were read.
    pub(crate) fn facts(&self, inputs: &Inputs) -> Facts {
        let mut facts = Facts::new();
        facts.insert("ivcam".into(), env!("CARGO_PKG_VERSION").into());
        facts.insert("arithmetic".into(), arithmetic().into());
        for (name, hashes) in inputs {
            let hashes: Vec<String> = hashes.iter().map(|h| format!("{h:016x}")).collect();
            facts.insert(format!("the content of `{name}`"), hashes.join(" "));
        }
        facts.extend(self.plan.with_given(self.described.clone()));
        facts.retain(|name, _| !FREE.contains(&&**name));
        let mut say = |name: &str, value: String| facts.insert(name.to_owned(), value);
        if let Some(samples) = self.plan.fixed_samples() {
            say("samples", samples.to_string());
        }
        say("primitives", format!("{:?}", self.scene.primitives()));
        say("bounds", format!("{:?}", self.scene.bounds()));
        facts
    }

    /// Describes what was compiled of the scene, of which not everything may fit into the memory.
    pub(crate) fn compiled(&self) -> String {
        let scene = &self.scene;
        let left_out = scene.left_out().join("; ");
        format!("{:?} {:?} {left_out}", scene.primitives(), scene.bounds())
    }
}

impl Plan {
    /// Adds to the described choices the given options that they lack, so that all are there that
    /// determine the picture.
    pub(crate) fn with_given(
        &self,
        mut described: IndexMap<String, String>,
    ) -> IndexMap<String, String> {
        for (name, value) in self.given() {
            if !FREE.contains(&&*name) {
                described.entry(name).or_insert(value);
            }
        }
        described
    }

    /// Returns the number of samples if the samples themselves depend on it, so that none can be
    /// added.
    pub(crate) fn fixed_samples(&self) -> Option<u32> {
        match self.sampler {
            _ if self.adaptive => Some(self.stop.samples),
            SamplerKind::Jittered | SamplerKind::Blue => Some(self.pixel_sampler().samples),
            SamplerKind::Random
            | SamplerKind::Sobol
            | SamplerKind::Golden
            | SamplerKind::Center => None,
        }
    }
}
