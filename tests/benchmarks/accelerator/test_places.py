from benchmarks.accelerator.places import places


def test_each_place_takes_its_own_driver(tmp_path):
    for name in ("10_nvidia.json", "50_mesa.json"):
        (tmp_path / name).touch()
    cpu, gpu = places({"__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path)})
    assert cpu.environment["__EGL_VENDOR_LIBRARY_FILENAMES"] == str(tmp_path / "50_mesa.json")
    assert gpu.environment["__EGL_VENDOR_LIBRARY_FILENAMES"] == str(tmp_path / "10_nvidia.json")


def test_the_cpu_is_shown_no_gpu():
    cpu, gpu = places({})
    assert cpu.environment["CUDA_VISIBLE_DEVICES"] == ""
    assert "CUDA_VISIBLE_DEVICES" not in gpu.environment
