//! One node of the hierarchy in 32 bytes, so that the two children of a node, which are always looked at together, share one line of
//! a cache. Conty Estevez & Kulla's node (HPG 2018, section 4.1) takes 56; here a sphere stands for the box, the axis is folded onto an
//! octahedron (Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 2014) and angles are kept by the
//! sine of their half. Whatever quantising loses is added to the cone of normals.

use glam::Vec3;

use super::bounds::LightBounds;

/// Bounds of the lights below, and the way to them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Node {
    /// Centre of a sphere around all of them.
    pub centre: Vec3,
    /// The sphere's radius.
    pub radius: f32,
    /// See [`LightBounds::energy`].
    pub energy: f32,
    /// Two signed numbers of 16 bits.
    axis: u32,
    /// Two numbers of [`ANGLE_BITS`] bits: sin(θ_o/2) and sin(θ_e/2); flags above.
    cones: u32,
    /// Of the first of two siblings, the place where the second begins. Of the second, how many pairs after its own that of its children is (the
    /// first one's is the next).
    pub link: u32,
}

/// Two nodes with one parent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Pair(pub [Node; 2]);

const ANGLE_BITS: u32 = 14;
const ANGLE_STEPS: u32 = (1 << ANGLE_BITS) - 1;
const LEAF: u32 = 1 << 31;
const TWO_SIDED: u32 = 1 << 30;
const LAMBERTIAN: u32 = 1 << 29;
const EVEN: u32 = 1 << 28;

/// The narrowest cone of normals, as sin(θ_o/2): wide enough for the rounding of the axis, and for its cosine to differ from 1 in f32.
const NARROWEST: f32 = 3e-4;

impl Node {
    /// The node with these bounds.
    pub fn new(bounds: &LightBounds, is_leaf: bool, link: u32) -> Self {
        let axis = fold(bounds.axis);
        let lost = unfold(axis).distance(bounds.axis);
        let half = |cos: f32| (0.5 * (1.0 - cos)).clamp(0.0, 1.0).sqrt();
        // Angles add up to less than their halves' sines do.
        let normals = half(bounds.cos_normals) + (0.5 * lost).max(NARROWEST);
        let quantised = |half: f32| ((half * ANGLE_STEPS as f32).ceil() as u32).min(ANGLE_STEPS);
        let flag = |is: bool, bit: u32| if is { bit } else { 0 };
        let flags = flag(is_leaf, LEAF)
            | flag(bounds.two_sided, TWO_SIDED)
            | flag(bounds.lambertian, LAMBERTIAN)
            | flag(bounds.even, EVEN);
        let cones = quantised(normals) | quantised(half(bounds.cos_emission)) << ANGLE_BITS | flags;
        Self { centre: bounds.centre(), radius: bounds.radius, energy: bounds.energy, axis, cones, link }
    }

    /// Whether it has no nodes below.
    #[inline(always)]
    pub const fn is_leaf(&self) -> bool {
        self.cones & LEAF != 0
    }

    /// Whether some of the lights emit against their normals too.
    #[inline(always)]
    pub const fn is_two_sided(&self) -> bool {
        self.cones & TWO_SIDED != 0
    }

    /// Whether all of the lights fall off with the cosine to their normals.
    #[inline(always)]
    pub const fn is_lambertian(&self) -> bool {
        self.cones & LAMBERTIAN != 0
    }

    /// Whether each of the lights emits alike in all directions, all being of one kind.
    #[inline(always)]
    pub const fn is_even(&self) -> bool {
        self.cones & EVEN != 0
    }

    /// Whether the normals may point anywhere.
    #[inline(always)]
    pub const fn faces_all_ways(&self) -> bool {
        self.cones & ANGLE_STEPS == ANGLE_STEPS
    }

    /// Unit axis of the cone of normals.
    #[inline(always)]
    pub fn axis(&self) -> Vec3 {
        unfold(self.axis)
    }

    /// cos θ_o, never more than it was.
    #[inline(always)]
    pub fn cos_normals(&self) -> f32 {
        cosine(self.cones & ANGLE_STEPS)
    }

    /// cos θ_e, never more than it was.
    #[inline(always)]
    pub fn cos_emission(&self) -> f32 {
        cosine(self.cones >> ANGLE_BITS & ANGLE_STEPS)
    }
}

/// cos θ = 1 − 2 sin²(θ/2).
#[inline(always)]
fn cosine(half: u32) -> f32 {
    let half = half as f32 * (1.0 / ANGLE_STEPS as f32);
    1.0 - 2.0 * half * half
}

/// A unit vector as a point of the octahedron's net.
fn fold(v: Vec3) -> u32 {
    let v = v / (v.x.abs() + v.y.abs() + v.z.abs()).max(f32::MIN_POSITIVE);
    let sign = |x: f32| 1.0f32.copysign(x);
    let (x, y) = if v.z >= 0.0 { (v.x, v.y) } else { ((1.0 - v.y.abs()) * sign(v.x), (1.0 - v.x.abs()) * sign(v.y)) };
    let quantised = |x: f32| u32::from(((x * 32767.0).round() as i16) as u16);
    quantised(x) | quantised(y) << 16
}

#[inline(always)]
fn unfold(folded: u32) -> Vec3 {
    let [x, y] = [folded as u16 as i16, (folded >> 16) as i16].map(|c| f32::from(c) * (1.0 / 32767.0));
    let z = 1.0 - x.abs() - y.abs();
    let beyond = if z < 0.0 { -z } else { 0.0 };
    let v = Vec3::new(x - beyond.copysign(x), y - beyond.copysign(y), z);
    v * (1.0 / v.length())
}
