//! The catalog of a folder of scenes: a page with a picture of every scene, and its data.
//!
//! `survey` reads a scene and makes its [`Entry`] and its thumbnail, `notes` finds what a file says
//! about itself, `links` finds the ways from the page to other files, `page` writes the entries as
//! HTML by what `template` has for all pages, and `make` puts them together and skips what is up to
//! date. All text of a page comes from strangers, so `template` escapes every string.

mod entry;
mod links;
mod make;
mod notes;
mod options;
mod page;
mod survey;
mod template;

pub(crate) use links::{joined, link};
pub(crate) use make::Catalog;
pub(crate) use options::CatalogOptions;
pub(crate) use template::{SCRIPT, STYLE, environment};
