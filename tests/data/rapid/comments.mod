! before; the IF module
MODULE Comments ! behind
  CONST string s:="no ! comment"; ! a comment; "with" quotes
  ! MoveL p1,v100,z10,tGun;
  PERS num a{2}:=[1, ! first; one
    ! between
    2]; ! last
  PROC main() !head
    MoveL p1,v100,! the zone
      z10,tGun;
    !
  ENDPROC
ENDMODULE
! after
