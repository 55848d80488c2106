//! Who is told how far it is.

/// Listens to a benchmark.
pub trait Watch {
    /// What is to be done in all, in units of work.
    fn begin(&self, total: f64);
    /// So many units more are done: a render, described in a line.
    fn done(&self, work: f64, line: &str);
    /// So many units of them need not be done after all.
    fn skip(&self, work: f64);
    /// Something that takes a while begins.
    fn say(&self, line: &str);
    /// All is done.
    fn finish(&self);
}

/// Nobody.
pub struct Nobody;

impl Watch for Nobody {
    fn begin(&self, _: f64) {}
    fn done(&self, _: f64, _: &str) {}
    fn skip(&self, _: f64) {}
    fn say(&self, _: &str) {}
    fn finish(&self) {}
}
