//! Materials that people know, as a table that hosts read.

use super::guard::guard;
use super::model::{SW_ENERGY_KOITER, SwMaterialDesc};
use super::status::{Fault, SwStatus};
use super::structs::{Output, read_descriptor};
use crate::material::{ElasticSheet, PRESETS, Preset};
use std::ffi::{CStr, c_char};

/// Number of materials in the table of presets.
#[unsafe(no_mangle)]
pub extern "C" fn sw_preset_count() -> u32 {
    PRESETS.len() as u32
}

/// A preset's name for files and scripts, such as "printer-paper": lower case, parted by hyphens. It never changes, but its index may.
/// "" at and beyond sw_preset_count(). Never NULL; constant.
#[unsafe(no_mangle)]
pub extern "C" fn sw_preset_name(index: u32) -> *const c_char {
    text_of(index, |preset| preset.name)
}

/// A preset's name for menus, such as "Printer paper, 80 g/m2". "" at and beyond sw_preset_count(). Never NULL; constant.
#[unsafe(no_mangle)]
pub extern "C" fn sw_preset_label(index: u32) -> *const c_char {
    text_of(index, |preset| preset.label)
}

/// Where a preset's numbers are from, and how far they vary. "" at and beyond sw_preset_count(). Never NULL; constant.
#[unsafe(no_mangle)]
pub extern "C" fn sw_preset_source(index: u32) -> *const c_char {
    text_of(index, |preset| preset.source)
}

/// Makes an initialised descriptor that of a preset: energy, young, poisson, thickness and volume_density. Mass is in kilograms.
/// `metres_per_unit` is how long the mesh's unit is: 1 for metres, 0.01 for centimetres. The numbers are as in docs/reference/materials.md.
/// Errors: SW_ERROR_INVALID_ARGUMENT, also at and beyond sw_preset_count(), SW_ERROR_INVALID_DESC.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_preset_material(
    index: u32,
    metres_per_unit: f64,
    material: *mut SwMaterialDesc,
) -> SwStatus {
    guard(|| {
        let Some(preset) = PRESETS.get(index as usize) else {
            return Err(Fault::argument(format!("index is {index}, but there are {} presets", PRESETS.len())));
        };
        if !(metres_per_unit > 0.0 && metres_per_unit.is_finite()) {
            return Err(Fault::argument(format!("metres_per_unit is {metres_per_unit:?}: it must be positive")));
        }
        let unit = metres_per_unit;
        let ElasticSheet { young, poisson, thickness, volume_density } = preset.sheet;
        let sheet = ElasticSheet {
            young: young * unit,
            poisson,
            thickness: thickness / unit,
            volume_density: volume_density * unit * unit * unit,
        }
        .validated()?;
        // SAFETY: the host passes a descriptor that has its struct_size, or NULL, which is refused.
        unsafe {
            let out = Output::checked("material", material)?;
            let mut desc = read_descriptor("material", material.cast_const())?;
            desc.energy = SW_ENERGY_KOITER;
            (desc.young, desc.poisson) = (sheet.young, sheet.poisson);
            (desc.thickness, desc.volume_density) = (sheet.thickness, sheet.volume_density);
            out.write(desc);
        }
        Ok(())
    })
}

fn text_of(index: u32, of: impl Fn(&'static Preset) -> &'static CStr) -> *const c_char {
    PRESETS.get(index as usize).map_or(c"", of).as_ptr()
}
