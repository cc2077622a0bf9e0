//! Lights points by a few of many lights, chosen at random.
//!
//! With hundreds of lights nearly all the time would go into shadow rays. Here a point has
//! [`PICKS`] of them. The light that reaches it without shadows is computed for every light, and
//! each light is picked in proportion to that (systematic sampling: the lights lie end to end on a
//! line, and the picks are at equal distances from a random start). The light of a pick is divided
//! by the expected number of picks, so the mean is the sum over all lights, and only the shadows
//! are noisy.
//!
//! The random start is a hash of the point's position, so a picture has the same bits at any number
//! of threads.

use glam::Vec3;
use ivcam_base::math::lanes::{
    LANES, Lanes, SimdKernel, Vec3Lanes, bits, dispatch, of_lane, set_lane,
};
use ivcam_optics::sampling::{mix, unit};

use super::counts::RayCounts;
use super::lanes::{Gathered, LightLanes};
use super::shader::{Shader, Work};
use crate::bvh::RayPacket;
use crate::scene::{Light, SHADOW_END};

/// The largest number of lights of a surface that all have shadow rays.
pub(super) const MANY_LIGHTS: usize = 64;

/// Shadow rays from a point with many lights.
const PICKS: f64 = 8.0;

/// One light on the points of a packet, without shadows.
#[derive(Clone, Debug)]
struct LightWeight {
    /// The factor of the diffuse color.
    share: Lanes<f32>,
    /// The factor of the specular color.
    highlight: Lanes<f32>,
    /// The sum of the color's components.
    weight: Lanes<f32>,
}

/// A light that was picked for a point.
#[derive(Clone, Copy, Debug)]
struct Pick {
    light: u32,
    lane: u32,
    /// The number of picks divided by the expected number.
    factor: f32,
}

/// The buffers of the choice among many lights.
#[derive(Debug, Default)]
pub(super) struct LightChoice {
    weights: Vec<LightWeight>,
    picks: Vec<Pick>,
    queue: ShadowQueue,
}

/// Shadow rays to be traced together, with the light that arrives if nothing is in the way.
#[derive(Debug, Default)]
struct ShadowQueue {
    rays: RayPacket,
    light: Vec3Lanes,
    lanes: Lanes<u8>,
    count: usize,
}

impl Shader<'_> {
    /// Adds the light of many lights to the radiances of some lanes.
    pub(super) fn add_some_lights<'l>(
        &self,
        lights: impl Iterator<Item = &'l Light>,
        lanes: u32,
        radiances: &mut Vec3Lanes,
        work: &mut Work,
    ) {
        let mut choice = std::mem::take(&mut work.choice);
        let lights: Vec<&Light> = lights.collect();
        choice.choose(&lights, lanes, work);
        let points = &work.points;
        for pick in &choice.picks {
            let (light, lane) = (lights[pick.light as usize], pick.lane as usize);
            let weight = &choice.weights[pick.light as usize];
            let diffuse = of_lane(&points.gathered.diffuse, lane) * weight.share[lane];
            let specular = match points.shiny >> lane & 1 {
                1 => of_lane(&points.gathered.specular, lane) * weight.highlight[lane],
                _ => Vec3::ZERO,
            };
            let arriving = light.color * (diffuse + specular) * pick.factor;
            if !self.casts_shadows(light) {
                let sum = of_lane(radiances, lane) + arriving;
                set_lane(radiances, lane, sum);
                continue;
            }
            let incident = light.reach(of_lane(&points.placed.position, lane));
            let mut ray = points.placed.leave(lane, incident.toward);
            ray.t_max = incident.distance * SHADOW_END;
            let queue = &mut choice.queue;
            queue.rays.set(queue.count, &ray);
            set_lane(&mut queue.light, queue.count, arriving);
            queue.lanes[queue.count] = lane as u8;
            queue.count += 1;
            if queue.count == LANES {
                self.flush(queue, radiances, &mut work.counts);
            }
        }
        self.flush(&mut choice.queue, radiances, &mut work.counts);
        work.choice = choice;
    }

    /// Traces the rays of a queue and adds their light to the radiances of their points.
    fn flush(&self, queue: &mut ShadowQueue, radiances: &mut Vec3Lanes, counts: &mut RayCounts) {
        let mut through = [1.0; LANES];
        self.scene.transmittances(&queue.rays, &mut through);
        counts.shadow += queue.count as u64;
        for (i, &lane) in queue.lanes[..queue.count].iter().enumerate() {
            let lane = usize::from(lane);
            let sum = of_lane(radiances, lane) + of_lane(&queue.light, i) * through[i];
            set_lane(radiances, lane, sum);
        }
        (queue.count, queue.rays.mask) = (0, 0);
    }
}

impl LightChoice {
    /// Picks lights for the points of some lanes.
    fn choose(&mut self, lights: &[&Light], lanes: u32, work: &mut Work) {
        let points = &mut work.points;
        let mut sums = [0.0; LANES];
        let none = LightWeight {
            share: [0.0; LANES],
            highlight: [0.0; LANES],
            weight: [0.0; LANES],
        };
        self.weights.resize(lights.len(), none);
        for (light, to) in lights.iter().zip(&mut self.weights) {
            points.reach(light, lanes);
            points.shine();
            dispatch(Weigh {
                points: &points.gathered,
                shiny: points.shiny,
                lit: &points.lit,
                color: light.color,
                to,
                sums: &mut sums,
            });
        }
        let mut starts = [0.0; LANES];
        for lane in bits(lanes) {
            let [x, y, z] = of_lane(&points.placed.position, lane)
                .to_array()
                .map(f32::to_bits);
            let key = mix(u64::from(x) << 32 | u64::from(y));
            starts[lane] = unit(mix(key ^ u64::from(z)));
        }
        self.picks.clear();
        dispatch(PickLights {
            weights: &self.weights,
            sums: &sums,
            starts,
            picks: &mut self.picks,
        });
    }
}

/// Computes the light of one light without shadows, and adds it to the sums over all lights.
struct Weigh<'a> {
    points: &'a Gathered,
    shiny: u32,
    lit: &'a LightLanes,
    color: Vec3,
    to: &'a mut LightWeight,
    sums: &'a mut Lanes<f64>,
}

impl SimdKernel for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        let (mask, shiny, color) = (self.lit.rays.mask, self.shiny, self.color);
        for i in 0..LANES {
            let of = |colors: &Vec3Lanes| {
                (color.x * colors[0][i] + color.y * colors[1][i] + color.z * colors[2][i]).abs()
            };
            let share = if mask >> i & 1 == 1 {
                self.lit.share[i]
            } else {
                0.0
            };
            let on = (mask & shiny) >> i & 1 == 1;
            let highlight = if on { self.lit.highlight[i] } else { 0.0 };
            let specular = if on { of(&self.points.specular) } else { 0.0 };
            let weight = of(&self.points.diffuse) * share + specular * highlight;
            self.to.share[i] = share;
            self.to.highlight[i] = highlight;
            self.to.weight[i] = weight;
            self.sums[i] += f64::from(weight);
        }
    }
}

/// Picks lights by their weights.
struct PickLights<'a> {
    weights: &'a [LightWeight],
    /// The sum of the weights of each lane.
    sums: &'a Lanes<f64>,
    /// Random numbers from 0 to 1.
    starts: Lanes<f64>,
    picks: &'a mut Vec<Pick>,
}

impl SimdKernel for PickLights<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        // The expected number of picks of all lights so far, plus the start.
        let mut ends = self.starts;
        let mut scale = [0.0f64; LANES];
        for (scale, sum) in scale.iter_mut().zip(self.sums) {
            *scale = if *sum > 0.0 { PICKS / *sum } else { 0.0 };
        }
        let mut before = [0.0f64; LANES];
        for (light, of) in self.weights.iter().enumerate() {
            let mut counts = [0.0f64; LANES];
            let mut any = 0u32;
            for i in 0..LANES {
                ends[i] += f64::from(of.weight[i]) * scale[i];
                let whole = ends[i].trunc();
                counts[i] = whole - before[i];
                before[i] = whole;
                any |= u32::from(counts[i] > 0.0);
            }
            if any == 0 {
                continue;
            }
            for (lane, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0.0) {
                let expected = f64::from(of.weight[lane]) * scale[lane];
                self.picks.push(Pick {
                    light: light as u32,
                    lane: lane as u32,
                    factor: (count / expected) as f32,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{PacketHits, Ray};
    use crate::scene::{CompileOptions, RenderScene};
    use crate::shade::{ShadeOptions, Shading};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    /// Returns the differences between the radiances of points on a floor with some of 300 lights
    /// and with all of them, and the mean radiance.
    fn differences(shapes: &str) -> (Vec<f32>, f32) {
        let mut text = "#Inventor V2.1 ascii\nEnvironment { attenuation 1 0 0 }\n".to_owned();
        for i in 0..300 {
            let angle = 2.4 * i as f32;
            let (x, z) = (libm::cosf(angle), libm::sinf(angle));
            let radius = 0.2 * (i as f32).sqrt();
            let place = format!("{} {} {}", radius * x, 1 + i % 3, radius * z);
            let color = [1.0, 0.3, 2.0][i % 3];
            text += &format!("PointLight {{ location {place} intensity .01 color {color} 1 1 }}\n");
        }
        text += "DirectionalLight { intensity .1 direction .2 -1 .1 }
            SpotLight { location 0 3 0 direction 0 -1 0 intensity .5 cutOffAngle .4 }
            Separator { Material { specularColor .5 .5 .5 shininess .3 }
            Translation { translation 0 -1.3 0 } Cube { width 9 depth 9 height 2 } }\n";
        text += shapes;
        let document = Document::read_headerless("m.iv", text.into_bytes()).unwrap();
        let snapshot = Snapshot::at(&document, 0.0);
        let scene = RenderScene::compile(&snapshot, &CompileOptions::default()).unwrap();
        let shader = Shader::new(&scene, Shading::Recursive, ShadeOptions::default());
        let (mut work, mut alone) = (Work::default(), Work::default());
        let (mut differences, mut sum) = (Vec::new(), 0.0);
        for packet in 0..60u16 {
            let mut rays = RayPacket::default();
            for lane in 0..LANES as u16 {
                let (x, z) = (f32::from(packet % 10) - 4.6, f32::from(packet / 10) - 2.7);
                let (x, z) = (
                    x + 0.03 * f32::from(lane % 8),
                    z + 0.03 * f32::from(lane / 8),
                );
                let origin = Vec3::new(x, 6.0, 0.9 * z);
                rays.set(
                    usize::from(lane),
                    &Ray::new(origin, Vec3::new(0.0, -1.0, 0.1)),
                );
            }
            let mut radiances = Vec3Lanes::default();
            let mut hits = PacketHits::default();
            shader.radiances(&rays, None, &mut hits, &mut radiances, &mut work);
            for lane in 0..LANES {
                let known = shader.radiance(&rays.ray(lane), &mut alone);
                differences.push((of_lane(&radiances, lane) - known).element_sum());
                sum += known.element_sum();
            }
        }
        assert!(work.counts.shadow * 10 < alone.counts.shadow);
        let count = differences.len() as f32;
        (differences, sum / count)
    }

    #[test]
    fn without_shadows_a_few_lights_have_the_light_of_all() {
        let (differences, mean) = differences("");
        let most = differences.iter().fold(0.0f32, |a, b| a.max(b.abs()));
        assert!(mean > 0.1 && most < 1e-4 * mean, "{most} of {mean}");
    }

    /// The differences of different points are independent.
    #[test]
    fn in_shadows_a_few_lights_have_the_light_of_all_on_average() {
        let (differences, mean) =
            differences("Translation { translation 0 .5 0 } Sphere { radius .4 }");
        let count = differences.len() as f64;
        let sum: f64 = differences.iter().copied().map(f64::from).sum();
        let squares: f64 = differences.iter().map(|d| f64::from(*d).powi(2)).sum();
        let z = sum / squares.sqrt();
        assert!(z.abs() < 3.5, "z = {z}");
        let noise = (squares / count).sqrt() as f32;
        assert!(
            noise > 1e-3 * mean && noise < 0.3 * mean,
            "{noise} of {mean}"
        );
    }
}
