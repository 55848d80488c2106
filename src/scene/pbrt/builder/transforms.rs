//! The directives that change the current transforms, and their numbers.

use glam::DMat4;

use super::{Builder, Result, overflow, syntax};
use crate::scene::pbrt::lexer::{self, TokenKind, shown};
use crate::scene::{SceneError, SceneErrorKind, Span};

/// What of a matrix's last row is more than what rounding leaves there.
const PERSPECTIVE: f64 = 1e-7;

impl Builder<'_, '_> {
    /// The 16 numbers of an affine matrix, column by column. All of them may be multiples of what is meant; perspective, which shapes and lights cannot
    /// have, is a fault and left out.
    pub(super) fn matrix(&mut self, span: Span) -> Result<DMat4> {
        let mut matrix = DMat4::from_cols_array(&self.numbers(true)?);
        let row = matrix.row(3);
        if row.w != 0.0 && row.w != 1.0 {
            matrix *= row.w.recip();
        }
        if row.w == 0.0 || row.truncate().abs().max_element() > PERSPECTIVE * row.w.abs() {
            let what = format!("the last row of this matrix is {} {} {} {}: a perspective", row.x, row.y, row.z, row.w);
            self.warnings.add_fault(span, what, "0 0 0 1 is taken");
        }
        (matrix.x_axis.w, matrix.y_axis.w, matrix.z_axis.w, matrix.w_axis.w) = (0.0, 0.0, 0.0, 1.0);
        Ok(matrix)
    }

    /// `N` numbers; brackets around them are allowed where `bracketed`.
    pub(super) fn numbers<const N: usize>(&mut self, bracketed: bool) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        let mut token = self.reader.expect("a number")?;
        let open = bracketed && token.kind == TokenKind::Open;
        for (i, value) in values.iter_mut().enumerate() {
            if i > 0 || open {
                token = self.reader.expect("a number")?;
            }
            let text = self.reader.text(&token);
            if token.kind != TokenKind::Word {
                return syntax(token.span, format!("expected number {} of {N}, found {}", i + 1, shown(text)));
            }
            *value = lexer::number(text).map_err(|m| SceneError::at(token.span, SceneErrorKind::Syntax(m)))?;
        }
        if open {
            let token = self.reader.expect("]")?;
            if token.kind != TokenKind::Close {
                let found = shown(self.reader.text(&token));
                return syntax(token.span, format!("expected ] after {N} numbers, found {found}"));
            }
        }
        Ok(values)
    }

    pub(super) fn concat(&mut self, matrix: DMat4, span: Span) -> Result<()> {
        if self.state.ctm.concat(matrix) { Ok(()) } else { overflow(span) }
    }

    pub(super) fn set(&mut self, matrix: DMat4, span: Span) -> Result<()> {
        if self.state.ctm.set(matrix) { Ok(()) } else { overflow(span) }
    }

    pub(super) fn active_transform(&mut self) -> Result<()> {
        let token = self.reader.expect("StartTime, EndTime or All")?;
        let (start, end) = match self.reader.text(&token) {
            "StartTime" => (true, false),
            "EndTime" => (false, true),
            "All" => (true, true),
            other => {
                return syntax(token.span, format!("expected StartTime, EndTime or All, found {}", shown(other)));
            }
        };
        self.state.ctm.activate(start, end);
        Ok(())
    }
}
