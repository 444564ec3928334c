//! Temporary.
use alhazen::*;
#[test]
fn tune() {
    let var = |n: &str, d: &str| std::env::var(n).unwrap_or(d.into());
    let num = |n: &str, d: &str| var(n, d).parse::<u32>().unwrap();
    let text = var("SCENE", "cornell");
    let (name, cam) = text.split_once('@').map_or((text.as_str(), None), |(a, b)| (a, Some(b)));
    let mut loaded = Source::parse(name).load(&LoadOptions::default()).unwrap();
    add_daylight_if_dark(&mut loaded.scene, &mut loaded.report, None);
    let mut job = Job { width: num("W", "256"), height: num("H", "144"), ..Job::for_scene(&loaded.scene) };
    if let Some(cam) = cam {
        let v: Vec<f32> = cam.split([',', ':']).map(|x| x.parse().unwrap()).collect();
        job.camera.eye = glam::vec3(v[0], v[1], v[2]);
        job.camera.target = glam::vec3(v[3], v[4], v[5]);
    }
    let mut renderer = Renderer::cpu(Some(2)).unwrap();
    renderer.load(&loaded.scene).unwrap();
    let cpu = || {
        let s = std::fs::read_to_string("/proc/self/stat").unwrap();
        let f: Vec<&str> = s.rsplit(") ").next().unwrap().split(' ').collect();
        (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
    };
    for g in var("G", "off,on").split(',') {
        if let Integrator::Path(p) = &mut job.integrator { p.guiding = g.parse().unwrap(); }
        job.seed = num("SEED", "1");
        let t = cpu();
        let limits = Limits { spp: num("SPP", "8"), ..Limits::default() };
        renderer.restart();
        renderer.render(&job, &limits, &Control::new()).unwrap();
        let t = cpu() - t;
        for n in renderer.take_notices() { println!("{n}"); }
        let film = renderer.film().unwrap().unwrap();
        let n = film.relative_error().unwrap();
        let mean = film.pixels().iter().map(|p| p.mean()[1]).sum::<f64>() / film.pixels().len() as f64;
        println!("{name} {g}: cpu {t:.2} s noise {n:.4} mean {mean:.5} eff {:.3}", 1.0 / (n * n * t));
    }
}
