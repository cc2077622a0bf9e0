//! Reads the textures that nodes name, each file once, within the memory of the scene.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{MAX_PICTURE, read_file};
use ivcam_base::memory::MemoryBudget;
use ivcam_inventor::grammar::value::{Image, Text};
use ivcam_inventor::grammar::{
    ClassId, Field, class, image_texture, texture2, texture3, vrml97_background,
};
use ivcam_inventor::iv::NodeRef;
use ivcam_optics::picture::Raster;

use super::texture::Texture;
use crate::scene::options::ColorCoding;

/// A field with file names.
#[derive(Clone, Copy)]
pub(crate) enum FileField {
    /// A field with one name.
    One(Field<Text>),
    /// A field with a list of names.
    Several(Field<[String]>),
}

impl FileField {
    /// Returns the names in the field of a node, and no names if the node has no such field.
    pub(crate) fn names<'a>(self, node: NodeRef<'a>) -> impl Iterator<Item = &'a str> {
        let (one, several): (_, &[String]) = match self {
            Self::One(field) => (node.find(field), &[]),
            Self::Several(field) => (None, node.find(field).unwrap_or(&[])),
        };
        let all = one.into_iter().chain(several.iter().map(String::as_str));
        all.filter(|name| !name.is_empty())
    }
}

/// The fields of a VRML 97 `Background` that name pictures.
pub(crate) const PANORAMA: [FileField; 6] = [
    FileField::Several(vrml97_background::BACK_URL),
    FileField::Several(vrml97_background::BOTTOM_URL),
    FileField::Several(vrml97_background::FRONT_URL),
    FileField::Several(vrml97_background::LEFT_URL),
    FileField::Several(vrml97_background::RIGHT_URL),
    FileField::Several(vrml97_background::TOP_URL),
];

/// Returns whether the nodes of a class show a picture that their fields name.
pub(crate) fn shows_picture(class: ClassId) -> bool {
    use class::{IMAGE, IMAGE_TEXTURE, MOVIE_TEXTURE, TEXTURE2, TEXTURE3};
    matches!(
        class,
        TEXTURE2 | TEXTURE3 | IMAGE | IMAGE_TEXTURE | MOVIE_TEXTURE
    )
}

/// The fields of texture nodes that name pictures.
pub(crate) const PICTURES: [FileField; 3] = [
    FileField::One(texture2::FILENAME),
    FileField::Several(image_texture::URL),
    FileField::Several(texture3::FILENAMES),
];

/// The textures that were read, by file.
#[derive(Debug, Default)]
pub(crate) struct TextureFiles {
    /// The folders besides the scene's own that are searched.
    folders: Vec<PathBuf>,
    /// The textures by the name of their file and the meaning of their colors.
    read: HashMap<(String, ColorCoding), Arc<Texture>>,
    /// The textures by the file that names them, the name there, and the meaning of their colors.
    named: HashMap<(String, String, ColorCoding), Arc<Texture>>,
    /// Notices about textures that were shrunk.
    pub notices: Vec<Box<Diagnostic>>,
}

impl TextureFiles {
    /// Creates an empty store for files beside the scene and in some folders.
    pub(crate) fn new(folders: &[PathBuf]) -> Self {
        Self {
            folders: folders.to_vec(),
            ..Self::default()
        }
    }

    /// Returns the texture of a node: its file, or the image in the node. Returns `None` if it has
    /// neither. `colors` is what its colors mean. Its memory is taken from a budget; a texture that
    /// would take more than half of what remains is shrunk.
    ///
    /// # Errors
    /// Returns a diagnostic if the file cannot be found or read, or does not fit. It names the file
    /// and the places where it was searched.
    pub(crate) fn of_node(
        &mut self,
        node: NodeRef<'_>,
        colors: ColorCoding,
        memory: &mut MemoryBudget,
    ) -> Result<Option<Arc<Texture>>> {
        self.of_fields(node, &PICTURES, colors, memory)
    }

    /// Returns the texture of a node, like [`TextureFiles::of_node`], whose file is named by one of
    /// some fields.
    ///
    /// # Errors
    /// Returns the errors of [`TextureFiles::of_node`].
    pub(crate) fn of_fields(
        &mut self,
        node: NodeRef<'_>,
        fields: &[FileField],
        colors: ColorCoding,
        memory: &mut MemoryBudget,
    ) -> Result<Option<Arc<Texture>>> {
        if node.known_class().is_some_and(|c| c.is_a("Texture3")) {
            return self.deep(node, colors, memory);
        }
        let names = fields.iter().flat_map(|field| field.names(node));
        let mut diagnostic = None;
        for name in names {
            match self.file(node, name, colors, memory) {
                Ok(texture) => return Ok(Some(texture)),
                Err(error) => diagnostic = diagnostic.or(Some(error)),
            }
        }
        if let Some(image) = node.find(texture2::IMAGE)
            && image.width > 0
            && image.height > 0
        {
            let texture = Texture::from_image(image);
            return texture
                .map(|t| self.fitted(t.with_colors(colors), "in the scene", memory))
                .transpose();
        }
        match diagnostic {
            Some(error) => Err(match node.source() {
                Some(source) => error.at(source, node.span()),
                None => error,
            }),
            None => Ok(None),
        }
    }

    /// Returns the layers of a `Texture3`: its files, or the image in the node.
    fn deep(
        &mut self,
        node: NodeRef<'_>,
        colors: ColorCoding,
        memory: &mut MemoryBudget,
    ) -> Result<Option<Arc<Texture>>> {
        let mut slices = Vec::new();
        let mut left = *memory;
        for name in FileField::Several(texture3::FILENAMES).names(node) {
            let (name, bytes) = self.bytes(node, name)?;
            let layer = decoded(&bytes, &name, left)?;
            left.take(format!("the layer `{name}`"), layer.bytes())?;
            slices.push(layer);
        }
        if let Some(image) = node.find(texture3::IMAGES).filter(|_| slices.is_empty()) {
            let depth = usize::try_from(image.depth).unwrap_or(0).max(1);
            let each = (image.bytes.len() / depth).max(1);
            let layers = image.bytes.chunks_exact(each).take(depth);
            slices.extend(layers.filter_map(|bytes| {
                Texture::from_image(&Image {
                    bytes: bytes.into(),
                    ..image.clone()
                })
            }));
        }
        if slices.is_empty() {
            return Ok(None);
        }
        let mut first = slices.remove(0);
        first.deeper = slices;
        self.fitted(first.with_colors(colors), "of a `Texture3`", memory)
            .map(Some)
    }

    /// Returns the texture of a file next to the scene or in one of the folders.
    ///
    /// # Errors
    /// Returns the errors of [`TextureFiles::of_node`].
    pub(crate) fn file(
        &mut self,
        node: NodeRef<'_>,
        name: &str,
        colors: ColorCoding,
        memory: &mut MemoryBudget,
    ) -> Result<Arc<Texture>> {
        let source = node.source().map(|s| s.name.clone()).unwrap_or_default();
        let key = (source, name.to_owned(), colors);
        if let Some(texture) = self.named.get(&key) {
            return Ok(texture.clone());
        }
        let (name, bytes) = self.bytes(node, name)?;
        let read = (name, colors);
        let texture = match self.read.get(&read) {
            Some(texture) => texture.clone(),
            None => {
                let texture = decoded(&bytes, &read.0, *memory)?.with_colors(colors);
                self.fitted(texture, &format!("`{}`", read.0), memory)?
            }
        };
        self.read.insert(read, texture.clone());
        // A URI with the bytes of a picture is as long as the picture.
        if key.1.len() < 4096 {
            self.named.insert(key, texture.clone());
        }
        Ok(texture)
    }

    /// Returns the name and the bytes of a file next to the scene or in one of the folders.
    fn bytes(&self, node: NodeRef<'_>, name: &str) -> Result<(String, Vec<u8>)> {
        let beside = node.document.load_beside(node.id, name);
        beside.or_else(|error| in_folders(name, &self.folders).ok_or(error))
    }

    /// Takes the memory of a texture. One that would take more than half of what remains is halved
    /// until it does not, so that something is left for those after it.
    fn fitted(
        &mut self,
        mut texture: Texture,
        name: &str,
        memory: &mut MemoryBudget,
    ) -> Result<Arc<Texture>> {
        let (width, height) = (texture.width, texture.height);
        while texture.bytes() > memory.remaining() / 2 && texture.width.max(texture.height) > 1 {
            texture = texture.halved();
        }
        memory.take(format!("the picture {name}"), texture.bytes())?;
        if texture.width < width {
            let text = format!(
                "the picture {name} of {width}x{height} texels is shrunk to {}x{}, \
                 because it takes too much memory",
                texture.width, texture.height
            );
            let notice = Diagnostic::warning(text);
            self.notices
                .push(notice.with_help("`--memory SIZE` raises the limit"));
        }
        Ok(Arc::new(texture))
    }
}

/// Decodes the bytes of a file, if that fits into a budget.
fn decoded(bytes: &[u8], name: &str, mut memory: MemoryBudget) -> Result<Texture> {
    let what = format!("decoding `{name}`");
    let raster = Raster::decode_within(bytes, name, &mut |size| memory.take(&what, size))?;
    Ok(Texture::from_raster(raster))
}

/// Reads the file with a name's last component from the first folder that has it.
fn in_folders(name: &str, folders: &[PathBuf]) -> Option<(String, Vec<u8>)> {
    let file = Path::new(name).file_name()?;
    folders.iter().find_map(|folder| {
        let path = folder.join(file);
        Some((
            path.display().to_string(),
            read_file(&path, MAX_PICTURE).ok()?,
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::diag::ErrorKind;
    use ivcam_inventor::iv::Document;

    type Read = Result<Option<Arc<Texture>>>;

    /// Reads a scene of two textures with one file of 64x64 gray texels, and returns them with what
    /// remains of a budget.
    fn two_textures(budget: u64) -> (Vec<Read>, Vec<String>, u64) {
        let name = format!("ivcam-textures-{}-{budget}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        image::GrayImage::new(64, 64)
            .save(folder.join("a.png"))
            .unwrap();
        let text = "#Inventor V2.1 ascii\n\
                    Texture2 { filename \"a.png\" } Texture2 { filename \"./a.png\" }";
        std::fs::write(folder.join("scene.iv"), text).unwrap();
        let document = Document::open(folder.join("scene.iv")).unwrap();
        let mut files = TextureFiles::new(&[]);
        let mut memory = MemoryBudget::new(budget);
        let read = |node| files.of_node(node, ColorCoding::Levels, &mut memory);
        let textures = document.roots().map(read).collect();
        std::fs::remove_dir_all(&folder).unwrap();
        let notices = files.notices.iter().map(|d| d.message.clone()).collect();
        (textures, notices, memory.remaining())
    }

    #[test]
    fn a_file_with_two_names_is_in_memory_once() {
        let (textures, notices, left) = two_textures(60_000);
        let [Ok(Some(a)), Ok(Some(b))] = &textures[..] else {
            panic!("{textures:?}");
        };
        assert!(Arc::ptr_eq(a, b));
        assert!(notices.is_empty());
        assert_eq!(60_000 - left, 4 * 64 * 64 + 4 * 64 * 64 / 3);
    }

    #[test]
    fn a_texture_beyond_half_of_the_memory_is_shrunk_and_beyond_all_is_refused() {
        let (textures, notices, _) = two_textures(24_000);
        let shrunk = textures[0].as_ref().unwrap().as_ref().unwrap();
        assert_eq!((shrunk.width, shrunk.height), (32, 32));
        assert_eq!(notices.len(), 1);
        assert!(notices[0].contains("of 64x64 texels is shrunk to 32x32"));
        let (textures, notices, left) = two_textures(4_000);
        let error = textures[1].as_ref().unwrap_err();
        assert_eq!((error.kind, left), (ErrorKind::Limit, 4_000));
        assert!(
            error
                .message
                .contains("needs 4.0 kB of memory, and 3.9 kB of 3.9 kB are left")
        );
        assert!(notices.is_empty());
    }
}
