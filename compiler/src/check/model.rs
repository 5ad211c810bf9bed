//! The body of a model: parameters, inputs, statements, and the parts that it names.

use super::annotations::Expected;
use super::bindings::wrap;
use super::context::{Binding, Checker};
use super::measures::Measured;
use super::typed::{Expr, LocalId, Model, Param, Statement, Type, lets};
use super::types::Dimension;
use super::{InputValue, activity, finish};
use crate::diagnostic::{Code, Diagnostic};
use crate::parameters::Input;
use crate::source::Span;
use crate::suggest::nearest;
use crate::syntax::ast::{self, Item, ItemKind};
use std::collections::BTreeMap;

/// A part of a model's body, before it is given its full name.
pub(super) struct Entry<'a> {
    pub(super) decl: &'a ast::PartDecl,
    pub(super) span: Span,
    /// Whether it stands in a loop, so that there may be several of it.
    pub(super) grouped: bool,
    pub(super) shape: Expr,
    pub(super) tolerance: Option<Expr>,
}

/// A model while its items are gone through.
#[derive(Default)]
pub(super) struct Body<'a> {
    pub(super) statements: Vec<Statement>,
    pub(super) entries: Vec<Entry<'a>>,
    pub(super) measures: Vec<Measured<'a>>,
    pub(super) params: Vec<Param>,
    /// For each parameter the number of statements before it, and its default.
    pub(super) defaults: Vec<(usize, Option<Expr>)>,
    pub(super) inputs: Vec<Input>,
    /// The names of parameters and inputs.
    pub(super) declared: Vec<&'a ast::Ident>,
    /// Parts that have the name of a parameter or an input: the part's local, and both names.
    hiding: Vec<(LocalId, &'a ast::Ident, &'a ast::Ident)>,
    /// Whether it is that of the main model, whose measures are reported.
    pub(super) is_main: bool,
    /// The number of loops and of conditions around the items at hand.
    pub(super) loops: usize,
    conditions: usize,
}

/// The source of the values of a model's parameters.
#[derive(Clone, Copy)]
enum Source<'s> {
    /// The main model: parameters are free, inputs are given from outside.
    Main(&'s BTreeMap<String, InputValue>),
    /// A model within another: the types of the arguments, `None` where one has its default.
    Call(&'s [Option<Type>]),
}

impl<'a> Checker<'a> {
    /// Checks the main file's model, if it has one, and then what no call has reached.
    pub(super) fn check_main(&mut self, inputs: &BTreeMap<String, InputValue>) -> Option<Model> {
        let model = |item: &'a Item| if let ItemKind::Model(model) = &item.kind { Some(model) } else { None };
        let models: Vec<&'a ast::Model> = self.modules[0].items.iter().filter_map(model).collect();
        let chosen = match &self.options.model {
            None => models.last(),
            Some(name) => models.iter().find(|m| m.name.text == *name),
        };
        if let (None, Some(name)) = (chosen, &self.options.model) {
            let span = self.modules[0].items.first().map_or(Span::default(), |i| i.span);
            let diagnostic = Diagnostic::new(Code::UnknownName, span, format!("this file has no model '{name}'"));
            let near = nearest(name, models.iter().map(|m| m.name.text.as_str()));
            self.report(match near {
                Some(near) => diagnostic.hint(format!("did you mean '{near}'?")),
                None => diagnostic,
            });
        }
        let model = chosen.map(|model| self.main_model(model, inputs));
        self.check_annotated(0);
        for other in models.iter().filter(|m| chosen.is_none_or(|main| !std::ptr::eq(*main, **m))) {
            self.check_model(other);
        }
        model
    }

    /// Brings the names of a model's body into scope, as that of a session. Parts in loops become arrays.
    pub(super) fn scope_of_model(&mut self, decl: &'a ast::Model, inputs: &BTreeMap<String, InputValue>) -> Body<'a> {
        let mut body = Body::default();
        self.items_of_model(&decl.items, &mut body, Source::Main(inputs), &mut Vec::new());
        for group in groups(std::mem::take(&mut body.entries)) {
            if self.env.names.iter().all(|(n, _)| *n != group.name.text) {
                let value = self.group_value(group.shapes, group.is_array, group.name.span);
                self.bind_name(group.name, value, &mut body.statements);
            }
        }
        body
    }

    /// The main model, whose parameters are free.
    pub(super) fn main_model(&mut self, decl: &'a ast::Model, inputs: &BTreeMap<String, InputValue>) -> Model {
        let mut body = Body { is_main: true, ..Body::default() };
        self.items_of_model(&decl.items, &mut body, Source::Main(inputs), &mut Vec::new());
        self.unknown_inputs(decl, inputs);
        self.hidden_parameters(&body);
        self.names_of_measures(&body);
        let parts = self.parts(&body.entries);
        self.parts_of_measures(&body.measures, &parts);
        let figures = self.figures(&parts);
        let failed = self.has_errors();
        if body.entries.is_empty() && !failed {
            let message = format!("the model '{}' has no parts", decl.name.text);
            self.report(Diagnostic::new(Code::NoParts, decl.name.span, message).hint("add one: part name = surface"));
        }
        for param in &body.params {
            if !self.used[param.local.0 as usize] && !failed {
                let message = format!("the parameter '{}' is not used", param.declared.name);
                self.report(Diagnostic::new(Code::UnusedParameter, param.declared.span, message));
            }
        }
        self.env.names.clear();
        let mut model = Model {
            name: decl.name.text.clone(),
            params: body.params,
            inputs: body.inputs,
            body: body.statements,
            parts,
            figures,
            ..Model::default()
        };
        let failed = self.has_errors();
        self.evaluate_params(&mut model.params, &body.defaults, &model.body);
        self.check_limits(&body.measures, &model.params, &body.defaults, &model.body);
        model.measures = self.measures(body.measures);
        finish::finish(self, &mut model);
        if !failed {
            activity::check(self, &model);
        }
        model
    }

    /// A model within another: its parts as a record.
    pub(super) fn submodel(&mut self, decl: &'a ast::Model, args: &[Option<Type>]) -> (Vec<LocalId>, Expr) {
        let mut body = Body::default();
        let mut locals = Vec::new();
        self.items_of_model(&decl.items, &mut body, Source::Call(args), &mut locals);
        self.hidden_parameters(&body);
        self.names_of_measures(&body);
        let span = decl.name.span;
        let fields = groups(body.entries).into_iter();
        let fields = fields.map(|g| (g.name.text.as_str(), self.group_value(g.shapes, g.is_array, span))).collect();
        let record = self.make_record(fields, span);
        (locals, wrap(body.statements, record, span))
    }

    fn group_value(&mut self, mut shapes: Vec<Expr>, is_array: bool, span: Span) -> Expr {
        if is_array { self.array(shapes, span) } else { shapes.swap_remove(0) }
    }

    fn items_of_model(
        &mut self,
        items: &'a [Item],
        body: &mut Body<'a>,
        source: Source<'_>,
        locals: &mut Vec<LocalId>,
    ) {
        let mut position = 0;
        self.pair_derivatives(items);
        for item in items {
            match &item.kind {
                ItemKind::Param(decl) | ItemKind::Input(decl) if body.loops + body.conditions > 0 => {
                    let message = format!(
                        "'{}' must be declared directly in its model, not in a loop or condition",
                        decl.name.text
                    );
                    self.report(Diagnostic::new(Code::Misplaced, item.span, message));
                    self.bind_local(&decl.name, Type::Error);
                }
                ItemKind::Param(decl) | ItemKind::Input(decl) => {
                    let free = matches!(item.kind, ItemKind::Param(_));
                    match source {
                        Source::Main(_) if free => self.param(decl, item, body),
                        Source::Main(inputs) => self.input(decl, item, body, inputs),
                        Source::Call(args) => {
                            let ty = args.get(position).cloned().flatten();
                            self.argument_param(decl, ty, body, locals);
                        }
                    }
                    position += 1;
                    body.declared.push(&decl.name);
                }
                ItemKind::Part(decl) => self.part(decl, item, body),
                ItemKind::Measure(decl) => self.measure(decl, item, body),
                ItemKind::For(decl) => {
                    let iterable = self.expr(&decl.iterable);
                    let Some(turns) = self.items("for", iterable, &mut body.statements) else { continue };
                    body.loops += 1;
                    for turn in turns {
                        let mark = self.env.names.len();
                        let begun = (body.entries.len(), body.measures.len());
                        self.bind(&decl.pattern, turn, &mut body.statements);
                        self.items_of_model(&decl.items, body, source, locals);
                        body.name_later_parts(begun);
                        self.env.names.truncate(mark);
                    }
                    body.loops -= 1;
                }
                ItemKind::If(decl) => self.if_items(decl, body, source, locals),
                _ => self.statement(item, &mut body.statements),
            }
        }
    }

    fn if_items(&mut self, decl: &'a ast::IfItems, body: &mut Body<'a>, source: Source<'_>, locals: &mut Vec<LocalId>) {
        let condition = self.expr(&decl.condition);
        let known = match condition.ty {
            Type::Bool(Some(holds)) => Ok(holds),
            Type::Bool(None) => self.evaluate_condition(&condition, body, source),
            _ => return self.condition_error(&condition),
        };
        let items = match known {
            Ok(true) => &decl.then,
            Ok(false) => &decl.otherwise,
            Err(error) => return self.report(error),
        };
        let mark = self.env.names.len();
        body.conditions += 1;
        self.items_of_model(items, body, source, locals);
        body.conditions -= 1;
        self.env.names.truncate(mark);
    }

    /// A condition on lengths, angles or real numbers, if it uses no parameter.
    fn evaluate_condition(
        &mut self,
        condition: &Expr,
        body: &Body<'a>,
        source: Source<'_>,
    ) -> Result<bool, Diagnostic> {
        let message = "the condition of an 'if' around parts must be known at compile time";
        let error = Diagnostic::new(Code::UnknownCondition, condition.span, message);
        if let Source::Call(_) = source {
            let hint = "in a model that is part of another, let it depend on inputs of the types int and bool only";
            return Err(error.hint(hint));
        }
        let params: Vec<&Param> = body.params.iter().collect();
        let values = self.evaluate(lets(&body.statements).collect(), &params, &[condition]);
        match values.into_iter().next() {
            Some(Ok(value)) => Ok(value != 0.0),
            Some(Err(reason)) => Err(error.label(reason).hint("let the condition depend on inputs only")),
            None => Err(error),
        }
    }

    fn part(&mut self, decl: &'a ast::PartDecl, item: &'a Item, body: &mut Body<'a>) {
        let tolerance = decl.tolerance.as_ref().map(|e| {
            let e = self.expr(e);
            self.coerce(e, &Expected::Real(Dimension::LENGTH), "a tolerance")
        });
        let shape = self.expr(&decl.shape);
        if let Some(before) = body.entries.iter().find(|e| e.decl.name.text == decl.name.text)
            && !std::ptr::eq(before.decl, decl)
        {
            let (message, span) = (format!("there are two parts '{}'", decl.name.text), before.decl.name.span);
            self.report(
                Diagnostic::new(Code::DuplicateName, decl.name.span, message).related(span, "first named here"),
            );
        }
        // Later statements may use the part by its name.
        self.bind_name(&decl.name, shape, &mut body.statements);
        let shape = self.name(&decl.name.text, decl.name.span);
        if let Some(parameter) = body.declared.iter().find(|p| p.text == decl.name.text)
            && let Some((_, Binding::Local(part))) = self.env.names.last()
        {
            // So far the model itself has used it only.
            self.used[part.0 as usize] = false;
            body.hiding.push((*part, &decl.name, parameter));
        }
        body.entries.push(Entry {
            decl,
            span: item.span,
            grouped: body.loops > 0,
            shape: Expr { span: decl.shape.span, ..shape },
            tolerance,
        });
    }

    /// Warns of parts in the place of parameters, where the name is used after them.
    fn hidden_parameters(&mut self, body: &Body<'a>) {
        for (part, name, parameter) in &body.hiding {
            if self.used[part.0 as usize] {
                let message = format!("from here on, '{}' is the part and not the parameter", name.text);
                self.report(
                    Diagnostic::new(Code::HiddenParameter, name.span, message)
                        .related(parameter.span, "this is hidden")
                        .hint("give the part another name"),
                );
            }
        }
    }
}

/// The parts of one name.
struct Group<'a> {
    name: &'a ast::Ident,
    shapes: Vec<Expr>,
    /// Whether its value is the array of them: they stand in a loop.
    is_array: bool,
}

fn groups(entries: Vec<Entry<'_>>) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for entry in entries {
        let name = &entry.decl.name;
        match groups.iter_mut().find(|g| g.name.text == name.text) {
            Some(group) => group.shapes.push(entry.shape),
            None => groups.push(Group { name, shapes: vec![entry.shape], is_array: entry.grouped }),
        }
    }
    groups
}
