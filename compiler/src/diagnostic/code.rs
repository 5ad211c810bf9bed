//! The kinds of mistake, each with a stable text and an explanation.

use super::Severity;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The variants, their texts, and the file that explains each: a code without one does not compile.
macro_rules! codes {
    (errors { $($error:ident $error_text:literal,)* } warnings { $($warning:ident $warning_text:literal,)* }) => {
        /// The kind of a mistake. Its text is stable: programs may rely on it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Code {
            $(#[doc = include_str!(concat!("codes/", $error_text, ".md"))] $error,)*
            $(#[doc = include_str!(concat!("codes/", $warning_text, ".md"))] $warning,)*
        }

        impl Code {
            /// All codes: errors, then warnings, both in alphabetical order.
            pub const ALL: &[Self] = &[$(Self::$error,)* $(Self::$warning,)*];

            /// The text that is printed and written to JSON, such as `unknown-name`.
            #[must_use]
            pub fn text(self) -> &'static str {
                match self {
                    $(Self::$error => $error_text,)*
                    $(Self::$warning => $warning_text,)*
                }
            }

            /// Whether a script with this mistake still compiles.
            #[must_use]
            pub fn severity(self) -> Severity {
                match self {
                    $(Self::$error => Severity::Error,)*
                    $(Self::$warning => Severity::Warning,)*
                }
            }

            /// Paragraphs and, for most codes, an example, in Markdown.
            #[must_use]
            pub fn explanation(self) -> &'static str {
                match self {
                    $(Self::$error => include_str!(concat!("codes/", $error_text, ".md")),)*
                    $(Self::$warning => include_str!(concat!("codes/", $warning_text, ".md")),)*
                }
            }
        }
    };
}

codes! {
    errors {
        Arguments "arguments",
        BadNumber "bad-number",
        BranchesDiffer "branches-differ",
        ComparisonChain "comparison-chain",
        Derivative "derivative",
        DimensionMismatch "dimension-mismatch",
        DuplicateName "duplicate-name",
        EmptyTuple "empty-tuple",
        Evaluation "evaluation",
        ExponentRange "exponent-range",
        FileNotFound "file-not-found",
        FunctionChoice "function-choice",
        HiddenCharacter "hidden-character",
        IncompleteDerivative "incomplete-derivative",
        Index "index",
        IntArithmetic "int-arithmetic",
        Internal "internal",
        Interrupted "interrupted",
        InvalidType "invalid-type",
        Limit "limit",
        LostDerivative "lost-derivative",
        MachineCode "machine-code",
        Misplaced "misplaced",
        MissingElse "missing-else",
        MixedArray "mixed-array",
        NoDefault "no-default",
        NoDerivative "no-derivative",
        NoModel "no-model",
        NoValue "no-value",
        NotAFunction "not-a-function",
        NotASurface "not-a-surface",
        NotConstant "not-constant",
        NotFinite "not-finite",
        OutOfBounds "out-of-bounds",
        Outline "outline",
        Pattern "pattern",
        PrivateName "private-name",
        Recursion "recursion",
        Require "require",
        ReservedWord "reserved-word",
        RunTime "run-time",
        StrayPrime "stray-prime",
        Syntax "syntax",
        Tolerance "tolerance",
        TooDeep "too-deep",
        TooLarge "too-large",
        TooLong "too-long",
        TooManyErrors "too-many-errors",
        TooManyFiles "too-many-files",
        TypeMismatch "type-mismatch",
        UnclosedBracket "unclosed-bracket",
        UnclosedText "unclosed-text",
        UnknownCharacter "unknown-character",
        UnknownCondition "unknown-condition",
        UnknownEscape "unknown-escape",
        UnknownField "unknown-field",
        UnknownInput "unknown-input",
        UnknownLabel "unknown-label",
        UnknownLength "unknown-length",
        UnknownModule "unknown-module",
        UnknownName "unknown-name",
        UnknownType "unknown-type",
        UnknownUnit "unknown-unit",
        UnmatchedBracket "unmatched-bracket",
        UnusedValue "unused-value",
        UseCycle "use-cycle",
        VariableExponent "variable-exponent",
        WrongResult "wrong-result",
    }
    warnings {
        DerivativeJump "derivative-jump",
        EmptyRange "empty-range",
        HiddenFunction "hidden-function",
        HiddenParameter "hidden-parameter",
        InsideOut "inside-out",
        LookAlike "look-alike",
        NoInfluence "no-influence",
        NoParts "no-parts",
        NothingLeft "nothing-left",
        PassedThrough "passed-through",
        Touching "touching",
        UnreachableBound "unreachable-bound",
        UnusedName "unused-name",
        UnusedParameter "unused-parameter",
        ValueJump "value-jump",
    }
}

impl Code {
    /// The code with this text, if there is one.
    #[must_use]
    pub fn named(text: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|code| code.text() == text)
    }

    /// A script with this mistake.
    #[must_use]
    pub fn example(self) -> Option<&'static str> {
        let (_, rest) = self.explanation().split_once("```gml\n")?;
        Some(rest.split_once("```")?.0)
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}
