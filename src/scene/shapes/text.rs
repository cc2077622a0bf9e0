//! Text: hooks for the shapes that need fonts.

use crate::graph::State;
use crate::iv::NodeRef;
use crate::scene::Builder;

pub fn text2<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}

pub fn text3<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}

pub fn ascii_text<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}

/// VRML 97's `Text`.
pub fn text97<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}
