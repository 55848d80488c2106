//! The reader process alone: reads the file it is asked to and sends it to standard output.

fn main() {
    lanternfish_openvdb::run_reader_if_asked();
    eprintln!("vdb-reader is started by programs that read .vdb files, not by people");
    std::process::exit(2);
}
