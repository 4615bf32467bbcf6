//! No shader branches on uniforms alone.
//!
//! Lavapipe writes the values of uniforms that steer branches and loops into the shader and compiles it again whenever the
//! buffer is bound anew: each frame took half a second longer until all of a flight's values had come by once. What is fixed
//! for a pipeline belongs into a shader definition, the rest into arithmetic.

use naga::{AddressSpace, Block, Expression, Function, Handle, Module, Statement};

use super::modules;

/// What steers a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// Literals, constants and counters.
    Constant,
    /// A uniform at a fixed place, and constants.
    Uniform,
    /// Anything else.
    Other,
}

impl Source {
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Other, _) | (_, Self::Other) => Self::Other,
            (Self::Uniform, _) | (_, Self::Uniform) => Self::Uniform,
            _ => Self::Constant,
        }
    }
}

fn source(module: &Module, function: &Function, expression: Handle<Expression>) -> Source {
    let of = |inner: Handle<Expression>| source(module, function, inner);
    match function.expressions[expression] {
        Expression::Literal(_)
        | Expression::Constant(_)
        | Expression::Override(_)
        | Expression::ZeroValue(_)
        | Expression::LocalVariable(_) => Source::Constant,
        Expression::GlobalVariable(global) => match module.global_variables[global].space {
            AddressSpace::Uniform => Source::Uniform,
            _ => Source::Other,
        },
        Expression::Compose { ref components, .. } => {
            components.iter().fold(Source::Constant, |all, &part| all.and(of(part)))
        }
        Expression::Access { base, index } => of(base).and(of(index)),
        Expression::AccessIndex { base, .. } => of(base),
        Expression::Splat { value, .. } => of(value),
        Expression::Swizzle { vector, .. } => of(vector),
        Expression::Load { pointer } => of(pointer),
        Expression::Unary { expr, .. } | Expression::As { expr, .. } => of(expr),
        Expression::Binary { left, right, .. } => of(left).and(of(right)),
        Expression::Select { condition, accept, reject } => of(condition).and(of(accept)).and(of(reject)),
        Expression::Math { arg, arg1, arg2, arg3, .. } => {
            [arg1, arg2, arg3].into_iter().flatten().fold(of(arg), |all, part| all.and(of(part)))
        }
        _ => Source::Other,
    }
}

/// How many branches of `block` only uniforms steer.
fn steered(module: &Module, function: &Function, block: &Block) -> usize {
    let by_uniform = |condition| usize::from(source(module, function, condition) == Source::Uniform);
    let within = |block: &Block| steered(module, function, block);
    block
        .iter()
        .map(|statement| match statement {
            Statement::Block(inner) => within(inner),
            Statement::If { condition, accept, reject } => by_uniform(*condition) + within(accept) + within(reject),
            Statement::Switch { selector, cases } => {
                by_uniform(*selector) + cases.iter().map(|case| within(&case.body)).sum::<usize>()
            }
            Statement::Loop { body, continuing, break_if } => {
                break_if.map_or(0, by_uniform) + within(body) + within(continuing)
            }
            _ => 0,
        })
        .sum()
}

/// Names of the functions that branch on uniforms alone, entry points included.
fn functions_steered(module: &Module) -> Vec<String> {
    let functions = module.functions.iter().map(|(_, function)| function);
    let entries = module.entry_points.iter().map(|entry| (entry.name.clone(), &entry.function));
    functions
        .map(|function| (function.name.clone().unwrap_or_default(), function))
        .chain(entries)
        .filter(|(_, function)| steered(module, function, &function.body) > 0)
        .map(|(name, _)| name)
        .collect()
}

#[test]
fn no_shader_branches_on_uniforms_alone() {
    for (name, module) in modules() {
        assert_eq!(functions_steered(&module), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn branches_on_uniforms_are_found() {
    let source = "
        struct Flags { count: vec4<f32>, on: f32 }
        @group(0) @binding(0) var<uniform> flags: Flags;
        fn early(color: f32) -> f32 { if flags.on <= 0.0 { return color; } return 2.0 * color; }
        fn counted() -> f32 {
            let last = i32(flags.count.x) - 1;
            var sum = 0.0;
            for (var i = 0; i < last; i += 1) { sum += 1.0; }
            return sum;
        }
        fn mixed(color: f32) -> f32 { if color > flags.on { return 0.0; } return color; }
        fn fixed() -> f32 { var sum = 0.0; for (var i = 0; i < 4; i += 1) { sum += flags.on; } return sum; }
        @fragment fn fragment(@location(0) x: f32) -> @location(0) vec4<f32> {
            return vec4(early(x), counted(), mixed(x), fixed());
        }";
    let module = naga::front::wgsl::parse_str(source).expect("the source is valid");
    assert_eq!(functions_steered(&module), ["early", "counted"]);
}
