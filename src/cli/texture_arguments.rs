//! What the command line says of images on surfaces.

use std::path::PathBuf;

use bytesize::ByteSize;
use clap::Args;

use crate::material::mip_map::memory::TextureSettings;
use crate::render::TextureLevels;

/// Options of `lanternfish render`.
#[derive(Args, Debug)]
pub struct TextureArguments {
    /// Memory that images on surfaces may take, such as 500MB or 2GiB. Where they take more, they are cut into tiles on disk, and those in use are held in
    /// memory; the image stays the same.
    #[arg(long, value_name = "SIZE", default_value = "2GiB", help_heading = "Textures")]
    pub texture_memory: ByteSize,
    /// Keep the tiles in this folder, which is made if it is not there, for other renders [default: temporary files that go with the process].
    #[arg(long, value_name = "FOLDER", help_heading = "Textures")]
    pub texture_cache: Option<PathBuf>,
    /// At which level of detail images on surfaces are looked up.
    #[arg(long, value_enum, default_value_t = TextureLevels::Auto, help_heading = "Textures")]
    pub texture_levels: TextureLevels,
}

impl TextureArguments {
    /// How memory is shared.
    pub fn settings(&self) -> TextureSettings {
        TextureSettings { limit: self.texture_memory.as_u64(), folder: self.texture_cache.clone() }
    }
}
