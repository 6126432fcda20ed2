//! Sheets that people know, with where their numbers are from. In metres, kilograms and seconds.

use super::ElasticSheet;
use std::ffi::CStr;

/// A known sheet.
pub struct Preset {
    /// For files and scripts; it never changes.
    pub name: &'static CStr,
    /// For menus.
    pub label: &'static CStr,
    /// E in Pa, thickness in m, density in kg/m³.
    pub sheet: ElasticSheet,
    /// What the numbers are from, and how far they vary.
    pub source: &'static CStr,
}

const fn sheet(young: f64, poisson: f64, thickness: f64, volume_density: f64) -> ElasticSheet {
    ElasticSheet { young, poisson, thickness, volume_density }
}

/// All of them, in the order for menus: cloths, leaves, papers, plastics, metals. `docs/reference/materials.md` has this table. A label says where
/// all the numbers are estimates.
pub const PRESETS: [Preset; 11] = [
    Preset {
        name: c"denim",
        label: c"Denim, 12 oz",
        sheet: sheet(6.4e7, 0.0, 1.48e-4, 2750.0),
        source: c"Bending rigidity 0.144 to 0.227 gf cm^2/cm and extension 4.7 to 5.7 % at 500 gf/cm of six denims: Journal of \
            Textiles 2016, 4614168, table 5. Their means give E and the thickness of a sheet that bends and stretches so, thinner than the cloth's \
            0.8 to 1.2 mm; the density gives that sheet 407 g/m^2, 12 oz/yd^2. Poisson's ratio was not measured",
    },
    Preset {
        name: c"cotton",
        label: c"Cotton shirting, 120 g/m2",
        sheet: sheet(1e8, 0.0, 9e-5, 1330.0),
        source: c"Modulus times thickness along the two yarns: 4.0 and 10.4 kN/m of a cotton of 150 g/m^2: Penava, Simic Penava, Knezic, \
            Determination of the elastic constants of plain woven fabrics, 2014; 2.8 and 4.5 kN/m of one of 104 g/m^2: Clyde, Teran, Tamstorf, Modeling \
            and data-driven parameter estimation for woven fabrics, 2017; neither paper was to be had: both are read from FEMDiscreteShellBase.py of the \
            code Codim-IPC. Stiffness and weight are between. The bending length, 1.7 cm, is chosen, and so is Poisson's ratio; E and thickness are \
            those of a sheet that bends and stretches so, thinner than the cloth",
    },
    Preset {
        name: c"felt",
        label: c"Felt, 2 mm (estimate)",
        sheet: sheet(2e6, 0.0, 2e-3, 180.0),
        source: c"All four are estimates of this project, for want of a source: E within 0.4 to 10 MPa, density within 150 to 250 kg/m^3; \
            thinner sheets of fibres have 2.6 MPa at 125 kg/m^3: Allard, Atalla, Propagation of Sound in Porous Media, 2009, table 11.4, and 10 MPa \
            at 171 kg/m^3: Jaouen, Becot, Acoustical characterization of perforated facings, 2011, both as quoted by others",
    },
    Preset {
        name: c"leather",
        label: c"Leather, 2 mm",
        sheet: sheet(2e8, 0.4, 2e-3, 930.0),
        source: c"E 0.1 to 0.5 GPa, density 810 to 1050 kg/m^3: Materials Data Book, Cambridge University Engineering Department, 2003, as in Ashby, \
            Materials Selection in Mechanical Design. Thickness is chosen, and so is Poisson's ratio",
    },
    Preset {
        name: c"oak-leaf",
        label: c"Oak leaf with its veins (estimate)",
        sheet: sheet(4e8, 0.3, 2.5e-4, 800.0),
        source: c"All four are estimates of this project, for want of a source: a blade that swings as one with its veins, about thrice a second \
            at 10 cm; the blade between them is softer: Young's modulus of a butterbur leaf's veins about 60 MPa, eleven times that of its \
            lamina: Kobayashi, Daimaruya, Kuribayashi, Venation pattern of butterbur leaf, Journal of the Society of Materials Science, Japan, 2000",
    },
    Preset {
        name: c"maize-leaf",
        label: c"Maize leaf beside its midrib (estimate)",
        sheet: sheet(3e8, 0.3, 3e-4, 800.0),
        source: c"All four are estimates of this project, for want of a source; the midrib carries a long leaf: make it a thicker region",
    },
    Preset {
        name: c"printer-paper",
        label: c"Printer paper, 80 g/m2",
        sheet: sheet(4e9, 0.29, 1e-4, 800.0),
        source: c"E 3 to 8.9 GPa, density 480 to 860 kg/m^3 of paper and cardboard: Ashby, Materials and the Environment. Poisson's ratio is \
            chosen, below the 1/3 of isotropic sheets: The in-plane Poisson ratio of paper, Fibre Science and Technology, 1983, 297-309. \
            Thickness is chosen for 80 g/m^2",
    },
    Preset {
        name: c"card",
        label: c"Card, 300 g/m2",
        sheet: sheet(3e9, 0.29, 4e-4, 750.0),
        source: c"As of printer paper; thickness is chosen for 300 g/m^2",
    },
    Preset {
        name: c"pet-bottle",
        label: c"PET bottle, 0.3 mm",
        sheet: sheet(3e9, 0.38, 3e-4, 1350.0),
        source: c"E 2.76 to 4.14 GPa, density 1350 kg/m^3: Callister, Rethwisch, Materials Science and Engineering, appendix B. Thickness is \
            chosen, and so is Poisson's ratio, within the 0.33 to 0.46 that the appendix has of other plastics",
    },
    Preset {
        name: c"aluminium",
        label: c"Aluminium sheet, 1 mm",
        sheet: sheet(6.9e10, 0.33, 1e-3, 2710.0),
        source: c"Alloy 1100, E 69 GPa: Callister, Rethwisch, Materials Science and Engineering, table B.2",
    },
    Preset {
        name: c"steel",
        label: c"Steel sheet, 0.5 mm",
        sheet: sheet(2.07e11, 0.3, 5e-4, 7850.0),
        source: c"Steel A36, E 207 GPa: Callister, Rethwisch, Materials Science and Engineering, table B.2",
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_sheet_of_a_name_of_its_own() {
        for (k, preset) in PRESETS.iter().enumerate() {
            assert!(preset.sheet.validated().is_ok(), "{:?}", preset.name);
            assert!(!preset.label.is_empty() && !preset.source.is_empty());
            assert!(preset.name.to_bytes().iter().all(|c| c.is_ascii_lowercase() || *c == b'-'));
            assert!(PRESETS[..k].iter().all(|other| other.name != preset.name));
        }
    }

    /// Of strips held at one end: the slowest swing of 10 cm, 1.8751²/(2πL²) √(D/ρh), in Hz, and Peirce's bending length (D/ρhg)^⅓ in cm.
    fn strip(sheet: &ElasticSheet) -> (f64, f64) {
        let ElasticSheet { young, thickness, volume_density, .. } = sheet;
        let (bending, weight) = (young * thickness.powi(3) / 12.0, volume_density * thickness);
        let swing = 1.8751f64.powi(2) / (2.0 * std::f64::consts::PI * 0.1 * 0.1) * (bending / weight).sqrt();
        (swing, 100.0 * (bending / (weight * 9.80665)).cbrt())
    }

    /// The table and the list of the page.
    fn page() -> String {
        let row = |Preset { name, label, sheet, .. }: &Preset| {
            let ElasticSheet { young, poisson, thickness, volume_density } = sheet;
            let [name, label] = [name, label].map(|text| text.to_str().unwrap());
            let (swing, limp) = strip(sheet);
            format!(
                "| `{name}` | {label} | {young:e} | {poisson} | {thickness:e} | {volume_density} | {swing:.1} | {limp:.1} |\n"
            )
        };
        let source = |Preset { name, source, .. }: &Preset| {
            let [name, source] = [name, source].map(|text| text.to_str().unwrap());
            format!("- `{name}`: {source}.\n")
        };
        let head = "| name | label | E, Pa | ν | thickness, m | density, kg/m³ | 10 cm swing, Hz | bending length, cm |\n|---|---|---|---|---|---|---|---|\n";
        let rows: String = PRESETS.iter().map(row).collect();
        let sources: String = PRESETS.iter().map(source).collect();
        format!("{head}{rows}\n## Sources\n\n{sources}")
    }

    #[test]
    fn the_page_has_the_table() {
        let written = include_str!("../../docs/reference/materials.md");
        assert!(written.contains(&page()), "docs/reference/materials.md lacks this:\n{}", page());
    }

    /// Of the two cottons of the sources: stiffness along the two yarns, N/m, and weight, kg/m².
    #[test]
    fn cotton_stretches_and_weighs_within_what_was_measured() {
        let ElasticSheet { young, thickness, volume_density, .. } =
            PRESETS.iter().find(|preset| preset.name == c"cotton").unwrap().sheet;
        // As in FEMDiscreteShellBase.py: E in Pa, two multiples of it that are taken to add to it, from a line that is commented out, and the thickness.
        let heavy = [38.657_734_470_2, 14.147_381_242_4].map(|more| 0.821e6 * (1.0 + more) * 0.318e-3);
        let light = [15.557e6, 25.004e6].map(|modulus| modulus * 0.18e-3);
        let all = [heavy, light].concat();
        let least = all.iter().copied().fold(f64::INFINITY, f64::min);
        let most = all.iter().copied().fold(0.0, f64::max);
        assert!((heavy[0] / 10_400.0 - 1.0).abs() < 0.005 && (heavy[1] / 4_000.0 - 1.0).abs() < 0.02);
        assert!((light[0] / 2_800.0 - 1.0).abs() < 0.005 && (light[1] / 4_500.0 - 1.0).abs() < 0.005);
        assert!(least < young * thickness && young * thickness < most);
        assert!(0.1036 < volume_density * thickness && volume_density * thickness < 472.641_509 * 0.318e-3);
    }

    /// Denim's means of table 5: B of a strip is E h³/12, the extension gives E h.
    #[test]
    fn denim_bends_and_stretches_as_measured() {
        let ElasticSheet { young, thickness, volume_density, .. } =
            PRESETS.iter().find(|preset| preset.name == c"denim").unwrap().sheet;
        let gf = 9.80665e-3; // N
        let bending = [0.172, 0.144, 0.227, 0.147, 0.207, 0.148].iter().sum::<f64>() / 6.0 * gf * 1e-2;
        let extension = [5.515, 5.735, 4.695, 5.135, 4.710, 5.455].iter().sum::<f64>() / 6.0 / 100.0;
        let stretching = 500.0 * gf * 100.0 / extension;
        // The preset's numbers have two or three digits.
        assert!((young * thickness.powi(3) / 12.0 / bending - 1.0).abs() < 0.03);
        assert!((young * thickness / stretching - 1.0).abs() < 0.03);
        assert!((volume_density * thickness / 0.407 - 1.0).abs() < 0.01);
    }
}
