"""BLAS has one thread inside, and as many as before outside, whoever enters and leaves."""

import threading

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import fringeforce as ff
from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.reading import strip_reader


def threads() -> set[int]:
    return {part["num_threads"] for part in threadpool_info() if part["user_api"] == "blas"}


def test_the_number_of_threads_is_put_back() -> None:
    with threadpool_limits(2, user_api="blas"):
        with one_blas_thread(), one_blas_thread():
            assert threads() == {1}
        assert threads() == {2}
        with pytest.raises(ZeroDivisionError), one_blas_thread():
            raise ZeroDivisionError
        assert threads() == {2}


def test_threads_that_enter_meanwhile_do_not_keep_it_low() -> None:
    entered, leave = threading.Event(), threading.Event()

    def stay() -> None:
        with one_blas_thread():
            entered.set()
            leave.wait()

    with threadpool_limits(2, user_api="blas"):
        other = threading.Thread(target=stay)
        with one_blas_thread():
            other.start()
            entered.wait()
            assert threads() == {1}
        assert threads() == {2}
        leave.set()
        other.join()
        assert threads() == {2}


def test_frames_are_searched_with_one_thread(
    sensor: ff.Sensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, seen = ff.characterize(sensor), []
    search = strip_reader.isolated

    def watched(*arguments):
        seen.append(threads())
        return search(*arguments)

    monkeypatch.setattr(strip_reader, "isolated", watched)
    frame = model.expose(ff.polar(1.0, 10, 11), rng=0)
    with threadpool_limits(2, user_api="blas"):
        reader = ff.Reader(model)
        assert reader.search(frame).status is ff.Status.OK
        assert reader.read(frame).status is ff.Status.OK
        assert threads() == {2}
    assert seen == [{1}, {1}]
