//! NURBS curves and surfaces: hooks.

use crate::graph::State;
use crate::iv::NodeRef;
use crate::scene::Builder;

pub fn nurbs_surface<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}

pub fn indexed_nurbs_surface<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}

pub fn nurbs_curve<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}

pub fn indexed_nurbs_curve<'a>(_node: NodeRef<'a>, _state: &State<'a>, _out: &mut Builder<'a>) {}
