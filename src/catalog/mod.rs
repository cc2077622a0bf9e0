//! The catalog of a folder of scenes: pages with a picture of every scene, and its data.
//!
//! `survey` reads a scene and makes its `Entry` and its pictures: `notes` finds what a file says
//! about itself, `needs` what it needs, `formats` its identifiers, `tree` its nodes. `alike`
//! relates the entries. `page` and `scene_page` write them as HTML by what `template` has for all
//! pages, `table` and `linked` as data, at the places that `place` names and with the ways between
//! them that `links` finds; `live` copies a page that opens the scenes. `make` puts it together and
//! skips what is up to date. All text of a page comes from strangers, so `template` escapes every
//! string.

mod alike;
mod entry;
mod formats;
mod heading;
mod linked;
mod links;
mod live;
mod make;
mod needs;
mod notes;
mod numbers;
mod options;
mod page;
mod place;
mod scene_page;
mod sha256;
mod survey;
mod table;
mod template;
mod tree;

pub(crate) use links::{link, original};
pub(crate) use make::Catalog;
pub(crate) use options::CatalogOptions;
pub(crate) use template::{SCRIPT, STYLE, environment};
