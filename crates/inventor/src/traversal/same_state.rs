//! Compares states, to find parts of a scene that are drawn again with the same state.

use std::sync::Arc;

use super::light_list::LightList;
use super::state::{
    Coordinates, Diffuse, List, MaterialElement, ProfileCoordinates, ProfileElement, State,
    TextureCoordinates, TextureElement, UnitTexture,
};

impl State<'_> {
    /// Whether a shape looks the same in both states except for its place: all elements are equal
    /// but the matrix, the choice of the last `Switch`, the camera, and the nodes of material and
    /// environment.
    /// Lists of the document are compared by their address.
    pub fn is_like(&self, other: &Self) -> bool {
        // All fields are named, so that a new one cannot be forgotten.
        let Self {
            world_from_object: _,
            steps: _,
            switch: _,
            bindables: _,
            material_node: _,
            environment_node: _,
            camera: _,
            coordinates,
            geo_origin,
            normals,
            normal_binding,
            material,
            material_binding,
            texture,
            further_textures,
            texture_matrix,
            texture_coordinates,
            texture_indexed,
            hints,
            base_color,
            drawing,
            casts_shadow,
            on_top,
            highlight,
            texture_unit,
            complexity,
            font,
            environment,
            lights,
            clip_planes,
            profile_coordinates,
            profiles,
            unit,
            language,
        } = self;
        let appearance = is_same_material(material, &other.material)
            && *material_binding == other.material_binding
            && is_same_texture(texture.as_ref(), other.texture.as_ref())
            && are_same_units(further_textures, &other.further_textures)
            && *texture_matrix == other.texture_matrix
            && is_same_mapping(texture_coordinates, &other.texture_coordinates)
            && *texture_indexed == other.texture_indexed
            && *texture_unit == other.texture_unit
            && *base_color == other.base_color
            && *highlight == other.highlight;
        let geometry = is_same_coordinates(coordinates, &other.coordinates)
            && *geo_origin == other.geo_origin
            && is_one(normals, other.normals)
            && *normal_binding == other.normal_binding
            && *hints == other.hints
            && *drawing == other.drawing
            && *complexity == other.complexity
            && *font == other.font
            && is_same_profile_coordinates(profile_coordinates, &other.profile_coordinates)
            && are_same_profiles(profiles, &other.profiles)
            && *unit == other.unit
            && *language == other.language;
        appearance
            && geometry
            && *casts_shadow == other.casts_shadow
            && *on_top == other.on_top
            && *environment == other.environment
            && are_same_lights(lights, &other.lights)
            && (Arc::ptr_eq(clip_planes, &other.clip_planes) || clip_planes == &other.clip_planes)
    }
}

/// Whether two lists have the same lights. Lists that differ in the last 16 are not compared
/// further.
fn are_same_lights(mut a: &LightList, mut b: &LightList) -> bool {
    for _ in 0..=SHORT {
        if a.address() == b.address() {
            return true;
        }
        match (a.split_last(), b.split_last()) {
            (Some((last_a, before_a)), Some((last_b, before_b))) if last_a == last_b => {
                (a, b) = (before_a, before_b);
            }
            _ => return false,
        }
    }
    false
}

/// The length up to which the values of two lists of colors are compared. Longer ones are compared
/// by their address only.
const SHORT: usize = 16;

/// Whether two lists are one list of the document.
fn is_one<T>(a: &[T], b: &[T]) -> bool {
    std::ptr::eq(a, b)
}

fn is_same_list<T: PartialEq>(a: &List<'_, T>, b: &List<'_, T>) -> bool {
    match (a, b) {
        (List::One(a), List::One(b)) => a == b,
        (List::Many(a), List::Many(b)) => is_one(a, b) || a.len() <= SHORT && a == b,
        _ => false,
    }
}

fn is_same_material(a: &MaterialElement<'_>, b: &MaterialElement<'_>) -> bool {
    let diffuse = match (&a.diffuse, &b.diffuse) {
        (Diffuse::Colors(a), Diffuse::Colors(b)) => is_same_list(a, b),
        (Diffuse::Packed(a), Diffuse::Packed(b)) => is_one(a, b),
        (Diffuse::Rgba(a), Diffuse::Rgba(b)) => is_one(a, b),
        _ => false,
    };
    diffuse
        && is_same_list(&a.transparency, &b.transparency)
        && a.ambient == b.ambient
        && a.ambient_intensity == b.ambient_intensity
        && a.specular == b.specular
        && a.emissive == b.emissive
        && a.shininess == b.shininess
        && a.refraction == b.refraction
        && a.physical == b.physical
        && a.is_linear == b.is_linear
        && a.alpha == b.alpha
        && a.is_unlit == b.is_unlit
}

fn is_same_coordinates(a: &Coordinates<'_>, b: &Coordinates<'_>) -> bool {
    match (a, b) {
        (Coordinates::Three(a), Coordinates::Three(b)) => is_one(a, b),
        (Coordinates::Four(a), Coordinates::Four(b)) => is_one(a, b),
        (Coordinates::Geo(a), Coordinates::Geo(b)) => a.is_like(b),
        _ => false,
    }
}

fn is_same_profile_coordinates(a: &ProfileCoordinates<'_>, b: &ProfileCoordinates<'_>) -> bool {
    match (a, b) {
        (ProfileCoordinates::Two(a), ProfileCoordinates::Two(b)) => {
            is_one(a, b) || a.is_empty() && b.is_empty()
        }
        (ProfileCoordinates::Three(a), ProfileCoordinates::Three(b)) => is_one(a, b),
        _ => false,
    }
}

fn are_same_profiles(a: &Arc<Vec<ProfileElement<'_>>>, b: &Arc<Vec<ProfileElement<'_>>>) -> bool {
    let same = |(a, b): (&ProfileElement<'_>, &ProfileElement<'_>)| {
        a.node.id == b.node.id && is_same_profile_coordinates(&a.coordinates, &b.coordinates)
    };
    Arc::ptr_eq(a, b) || a.len() == b.len() && a.iter().zip(b.iter()).all(same)
}

fn is_same_mapping(a: &TextureCoordinates<'_>, b: &TextureCoordinates<'_>) -> bool {
    match (a, b) {
        (TextureCoordinates::Two(a), TextureCoordinates::Two(b)) => is_one(a, b),
        (TextureCoordinates::Three(a), TextureCoordinates::Three(b)) => is_one(a, b),
        (a, b) => a == b,
    }
}

fn are_same_units(a: &Arc<Vec<UnitTexture<'_>>>, b: &Arc<Vec<UnitTexture<'_>>>) -> bool {
    let same = |(a, b): (&UnitTexture<'_>, &UnitTexture<'_>)| {
        a.unit == b.unit
            && a.matrix == b.matrix
            && is_same_mapping(&a.coordinates, &b.coordinates)
            && is_same_texture(a.texture.as_ref(), b.texture.as_ref())
    };
    Arc::ptr_eq(a, b) || a.len() == b.len() && a.iter().zip(b.iter()).all(same)
}

fn is_same_texture(a: Option<&TextureElement<'_>>, b: Option<&TextureElement<'_>>) -> bool {
    let (Some(a), Some(b)) = (a, b) else {
        return a.is_none() && b.is_none();
    };
    let TextureElement {
        quality,
        repeat_r,
        node,
        model,
        blend_color,
        repeat_s,
        repeat_t,
        alpha,
    } = a;
    node.id == b.node.id
        && std::ptr::eq(node.document, b.node.document)
        && *model == b.model
        && *blend_color == b.blend_color
        && *quality == b.quality
        && *alpha == b.alpha
        && [*repeat_s, *repeat_t, *repeat_r] == [b.repeat_s, b.repeat_t, b.repeat_r]
}
