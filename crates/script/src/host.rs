//! The functions that `prelude.js` calls: nodes, routes, files, messages and limits.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use boa_engine::native_function::NativeFunctionPointer;
use boa_engine::object::ObjectInitializer;
use boa_engine::object::builtins::JsArray;
use boa_engine::property::Attribute;
use boa_engine::{
    Context, JsNativeError, JsObject, JsResult, JsValue, NativeFunction, Source, js_string,
};
use ivcam_base::diag::ErrorKind;
use ivcam_inventor::events::World;
use ivcam_inventor::iv::{Limits, NodeId};

use super::guard::{self, GROW};
use super::meter::{MAX_LIST, Meter};
use super::values::{from_data, items, node, script_type, text, to_data};

/// The number of times that scripts may create nodes, and the number of nodes that they may
/// create. Tests reach the limits sooner.
const MAX_CREATIONS: usize = if cfg!(test) { 100 } else { 2_000 };
const MAX_CREATED: usize = if cfg!(test) { 5_000 } else { 300_000 };

/// What the host's functions know about the script that calls them.
#[derive(Debug)]
pub(super) struct Host {
    pub world: Rc<RefCell<World>>,
    pub meter: Rc<Meter>,
    /// The script's node.
    pub id: NodeId,
    /// Whether the script may write the fields of nodes.
    pub direct: bool,
    /// The number of times that the scene's scripts have created nodes, and the nodes.
    pub creations: Rc<Cell<(usize, usize)>>,
}

/// Returns the host of the script that runs in a context.
fn host(context: &Context) -> JsResult<Rc<Host>> {
    let host = context.get_data::<Rc<Host>>().cloned();
    host.ok_or_else(|| JsNativeError::error().with_message("no host").into())
}

fn arg(args: &[JsValue], i: usize) -> JsValue {
    args.get(i).cloned().unwrap_or_default()
}

fn arg_node(args: &[JsValue], i: usize) -> NodeId {
    args.get(i).and_then(node).unwrap_or(NodeId(u32::MAX))
}

/// Returns the object with the host's functions and facts.
pub(super) fn host_object(host: &Rc<Host>, frame_rate: f64, context: &mut Context) -> JsObject {
    context.insert_data(host.clone());
    let world = host.world.borrow();
    let address = world
        .document
        .sources
        .first()
        .map_or("", |s| &s.name)
        .to_owned();
    drop(world);
    let math = math(context);
    let mut object = ObjectInitializer::new(context);
    let functions: [(NativeFunctionPointer, &str); 17] = [
        (get, "get"),
        (kind, "kind"),
        (put, "put"),
        (send, "send"),
        (class_name, "className"),
        (create, "create"),
        (load, "load"),
        (route, "route"),
        (tell, "tell"),
        (print, "print"),
        (now, "now"),
        (grow, "grow"),
        (fits, "fits"),
        (charge, "charge"),
        (stop, "stop"),
        (pattern, "pattern"),
        (evaluate, "evaluate"),
    ];
    for (function, name) in functions {
        object.function(NativeFunction::from_fn_ptr(function), js_string!(name), 0);
    }
    let fixed = Attribute::all();
    object.property(js_string!("math"), math, fixed);
    object.property(js_string!("name"), js_string!("ivcam"), fixed);
    object.property(
        js_string!("version"),
        js_string!(env!("CARGO_PKG_VERSION")),
        fixed,
    );
    object.property(js_string!("world"), js_string!(address.as_str()), fixed);
    object.property(js_string!("frameRate"), frame_rate, fixed);
    object.property(js_string!("growName"), js_string!(GROW), fixed);
    object.property(js_string!("most"), MAX_LIST as f64, fixed);
    object.build()
}

/// Returns the functions of `Math` that differ between machines, from `libm`.
fn math(context: &mut Context) -> JsObject {
    fn number(args: &[JsValue], i: usize, context: &mut Context) -> JsResult<f64> {
        arg(args, i).to_number(context)
    }
    macro_rules! one {
        ($f:path) => {
            |_, args, context| Ok($f(number(args, 0, context)?).into())
        };
    }
    macro_rules! two {
        ($f:path) => {
            |_, args, context| Ok($f(number(args, 0, context)?, number(args, 1, context)?).into())
        };
    }
    let functions: [(NativeFunctionPointer, &str); 10] = [
        (one!(libm::sin), "sin"),
        (one!(libm::cos), "cos"),
        (one!(libm::tan), "tan"),
        (one!(libm::asin), "asin"),
        (one!(libm::acos), "acos"),
        (one!(libm::atan), "atan"),
        (one!(libm::exp), "exp"),
        (one!(libm::log), "log"),
        (two!(libm::atan2), "atan2"),
        (two!(libm::pow), "pow"),
    ];
    let mut object = ObjectInitializer::new(context);
    for (function, name) in functions {
        object.function(NativeFunction::from_fn_ptr(function), js_string!(name), 0);
    }
    object.build()
}

/// Returns the type and data of a node's field, or nothing if it has none of that name.
fn get(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let (id, name) = (arg_node(args, 0), text(&arg(args, 1)));
    let found = host.world.borrow().field(id, &name);
    let Some((kind, value)) = found else {
        return Ok(JsValue::undefined());
    };
    let Some(kind) = script_type(kind) else {
        return Ok(JsValue::undefined());
    };
    let data = to_data(&value, context);
    Ok(JsArray::from_iter([js_string!(kind).into(), data.into()], context).into())
}

/// Returns the type of a node's event or field that can be sent a value.
fn kind(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let (id, name) = (arg_node(args, 0), text(&arg(args, 1)));
    let world = &mut *host.world.borrow_mut();
    match world.input_type(id, &name).and_then(script_type) {
        Some(kind) => Ok(js_string!(kind).into()),
        None => {
            let class = world.class_name(id);
            world.warn(
                host.id,
                format!("a script sets `{name}` of a `{class}`, which has none"),
            );
            Ok(JsValue::undefined())
        }
    }
}

/// Sends an event to a node, or sets its field, for a script with `directOutput TRUE`.
fn put(this: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    if host.direct {
        return send(this, args, context);
    }
    let world = &mut *host.world.borrow_mut();
    let message =
        "a script sets fields of nodes without `directOutput TRUE`; they stay as they are";
    world.warn(host.id, message.into());
    Ok(JsValue::undefined())
}

/// Sends an event to a node.
fn send(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let (id, name) = (arg_node(args, 0), text(&arg(args, 1)));
    let Some(kind) = host.world.borrow().input_type(id, &name) else {
        return Ok(JsValue::undefined());
    };
    let value = from_data(&arg(args, 2), kind, &host.meter, context)?;
    host.world.borrow_mut().send_directly(id, &name, &value);
    Ok(JsValue::undefined())
}

fn class_name(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let name = host.world.borrow().class_name(arg_node(args, 0));
    Ok(js_string!(name.as_str()).into())
}

/// Creates the nodes of a text. Returns their indices.
fn create(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let text = text(&arg(args, 0));
    let nodes = read_nodes(&host, "createVrmlFromString", text.into_bytes())?;
    Ok(indices(&nodes, context))
}

/// Creates the nodes of the first file of a list that the scene's loader opens.
fn load(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let mut reason = None;
    for url in items(&arg(args, 0), &host.meter, context)? {
        let loaded = host
            .world
            .borrow()
            .document
            .load_beside(host.id, &text(&url));
        match loaded {
            Ok((name, bytes)) => {
                let nodes = read_nodes(&host, &name, bytes)?;
                return Ok(indices(&nodes, context));
            }
            Err(error) => reason = reason.or(Some(error.message)),
        }
    }
    if let Some(reason) = reason {
        let message = format!("a script's `createVrmlFromURL` made no nodes: {reason}");
        host.world.borrow_mut().warn(host.id, message);
    }
    Ok(JsArray::new(context)?.into())
}

fn indices(nodes: &[NodeId], context: &mut Context) -> JsValue {
    let nodes = nodes.iter().map(|n| JsValue::from(f64::from(n.0)));
    JsArray::from_iter(nodes, context).into()
}

/// Reads nodes into the document.
fn read_nodes(host: &Host, name: &str, bytes: Vec<u8>) -> JsResult<Vec<NodeId>> {
    let (times, nodes) = host.creations.get();
    if times >= MAX_CREATIONS {
        return host.meter.stop(format!(
            "scripts create nodes more than {MAX_CREATIONS} times"
        ));
    }
    let world = &mut *host.world.borrow_mut();
    let first = world.document.nodes.len();
    let left = MAX_CREATED - nodes.min(MAX_CREATED);
    let limits = Limits {
        bytes: 64 << 20,
        nodes: first + left,
        copies: world.document.protos.copies + left,
        depth: 10_000,
        include_depth: 8,
        files: 100,
        ..Limits::default()
    };
    let routes = world.document.routes.len();
    let read = world.document.read_created(name, bytes, &limits);
    let created = world.document.nodes.len() - first;
    host.creations.set((times + 1, nodes + created));
    match read {
        Ok(roots) => {
            world.created(first, routes);
            Ok(roots)
        }
        Err(error) if error.kind == ErrorKind::Limit || created >= left => {
            let limit = format!("scripts create more than {MAX_CREATED} nodes");
            host.meter.stop(limit)
        }
        Err(error) => {
            let message = format!("a script's text made no nodes: {}", error.message);
            world.warn(host.id, message);
            Ok(Vec::new())
        }
    }
}

/// Adds or deletes a route.
fn route(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let (from, to) = (arg_node(args, 1), arg_node(args, 3));
    let (output, input) = (text(&arg(args, 2)), text(&arg(args, 4)));
    let adds = arg(args, 0).to_boolean();
    host.world
        .borrow_mut()
        .change_route(adds, (from, &output), (to, &input));
    Ok(JsValue::undefined())
}

/// Reports that a script asked for what a picture cannot do.
fn tell(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let name = text(&arg(args, 0));
    let message = format!("a script calls `Browser.{name}`, which is not followed");
    host.world.borrow_mut().warn(host.id, message).kind = ErrorKind::Unsupported;
    Ok(JsValue::undefined())
}

/// Reports what a script prints.
fn print(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let text: String = text(&arg(args, 0)).chars().take(200).collect();
    host.world
        .borrow_mut()
        .note(host.id, format!("a script prints: {text}"));
    Ok(JsValue::undefined())
}

fn now(_: &JsValue, _: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let now = host(context)?.world.borrow().now;
    Ok(now.into())
}

/// Measures a value, if it is a string, and returns it.
fn grow(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let value = arg(args, 0);
    if let Some(text) = value.as_string() {
        host(context)?.meter.grow(&text)?;
    }
    Ok(value)
}

fn fits(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let length = arg(args, 0).as_number().unwrap_or(0.0);
    host(context)?.meter.fits(length)?;
    Ok(JsValue::undefined())
}

fn charge(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let elements = arg(args, 0).as_number().unwrap_or(0.0);
    host(context)?.meter.charge(elements)?;
    Ok(JsValue::undefined())
}

fn stop(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    host(context)?.meter.stop(text(&arg(args, 0)))
}

fn pattern(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let host = host(context)?;
    let length = arg(args, 1).as_number().unwrap_or(0.0);
    match guard::pattern_fits(&text(&arg(args, 0)), length as usize) {
        Ok(()) => Ok(JsValue::undefined()),
        Err(message) => host.meter.stop(message),
    }
}

/// Evaluates a text as a program.
fn evaluate(_: &JsValue, args: &[JsValue], context: &mut Context) -> JsResult<JsValue> {
    let program = guard::guarded(&text(&arg(args, 0)));
    let program = program.map_err(|e| JsNativeError::syntax().with_message(e))?;
    context.eval(Source::from_bytes(program.as_bytes()))
}
