"""LikeMe perception: from RGB-D frames to what is where, and to acts of a person."""
