"""Traced pictures of a store: stills, films, and the window at rest.

room = room_of_store(store, scene_of(store))     what is traced; `set_materials` and `mix` change it
picture = TracedPicture(room.tracer, camera, size)
picture.sample(16); picture.denoised()
"""
